//! An image that is dropped on the page, kept as it arrives.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use std::pin::Pin;

use axum::body::{Body, HttpBody};

/// Bytes of the largest image that can be dropped; larger ones are named on the command line.
pub const MOST_BYTES: u64 = 1 << 30;

/// Writes a request's body to a new file.
///
/// # Errors
/// In words, if it is too large, breaks off, or cannot be written; a part of the file may be there then.
pub async fn receive(body: Body, path: &Path) -> Result<(), String> {
    let too_large = || format!("larger than {} MiB; name it on the command line", MOST_BYTES >> 20);
    if body.size_hint().lower() > MOST_BYTES {
        return Err(too_large());
    }
    let unwritable = |e: std::io::Error| format!("the image cannot be kept: {e}");
    let mut file =
        OpenOptions::new().write(true).create_new(true).open(path).map_err(unwritable)?;
    let (mut body, mut count) = (body, 0);
    while let Some(frame) = std::future::poll_fn(|cx| Pin::new(&mut body).poll_frame(cx)).await {
        let frame = frame.map_err(|e| format!("the image broke off: {e}"))?;
        let Ok(data) = frame.into_data() else { continue };
        count += data.len() as u64;
        if count > MOST_BYTES {
            return Err(too_large());
        }
        file.write_all(&data).map_err(unwritable)?;
    }
    if count == 0 {
        return Err("the file is empty".into());
    }
    file.flush().map_err(unwritable)
}
