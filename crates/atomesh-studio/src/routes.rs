//! What is where: the page, slices, and what is sent and fetched as files.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use atomesh_job::options::RunConfig;
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Query, State};
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use tokio::sync::{Mutex, oneshot};

use crate::drop_file::receive;
use crate::engine::{Export, Handle, Request, plain_name};
use crate::exhibit::What;
use crate::hub::Hub;
use crate::page::{ASSETS, Asset};
use crate::socket;

/// How long an image may take to arrive.
const DROP_TIME: Duration = Duration::from_secs(300);

/// What handlers need.
#[derive(Clone, Debug)]
pub struct Rooms {
    /// What is shown.
    pub hub: Arc<Hub>,
    /// Who does it.
    pub engine: Handle,
    /// The session's folder.
    folder: Arc<PathBuf>,
    /// One file arrives or leaves at a time.
    files: Arc<Mutex<u32>>,
}

impl Rooms {
    /// The rooms of a server.
    pub fn new(hub: Arc<Hub>, engine: Handle, folder: PathBuf) -> Self {
        Self { hub, engine, folder: Arc::new(folder), files: Arc::default() }
    }
}

/// The routes.
pub fn router(rooms: Rooms) -> Router {
    Router::new()
        .route("/", get(|| async { asset_named("index.html") }))
        .route("/{name}", get(|Path(name): Path<String>| async move { asset_named(&name) }))
        .route("/view/slice", get(slice))
        .route("/view/cells", get(cells))
        .route("/view/regions", get(regions))
        .route("/view/surface", get(surface))
        .route("/view/playback", get(playback))
        .route("/file/drop", post(drop_image))
        .route("/file/export", post(export))
        .route("/socket", get(open_socket))
        .method_not_allowed_fallback(|| async { StatusCode::METHOD_NOT_ALLOWED })
        .with_state(rooms)
}

fn asset_named(name: &str) -> Response {
    match ASSETS.iter().find(|asset| asset.name == name) {
        Some(Asset { kind, bytes, .. }) => ([(CONTENT_TYPE, *kind)], *bytes).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

async fn open_socket(State(rooms): State<Rooms>, upgrade: WebSocketUpgrade) -> Response {
    if !rooms.hub.come(socket::MOST_PAGES) {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open").into_response();
    }
    let present = socket::Present(rooms.hub.clone());
    let upgrade = upgrade.max_message_size(socket::MOST_BYTES).max_frame_size(socket::MOST_BYTES);
    upgrade.on_upgrade(move |socket| socket::serve(socket, rooms, present))
}

#[derive(Debug, Deserialize)]
struct SliceAt {
    what: What,
    axis: usize,
    at: usize,
}

async fn slice(
    State(rooms): State<Rooms>,
    Query(SliceAt { what, axis, at }): Query<SliceAt>,
) -> Response {
    looked(rooms, move |shown| shown.slice(what, axis, at)).await
}

#[derive(Debug, Deserialize)]
struct CellsAt {
    axis: usize,
    at: usize,
}

async fn cells(
    State(rooms): State<Rooms>,
    Query(CellsAt { axis, at }): Query<CellsAt>,
) -> Response {
    looked(rooms, move |shown| shown.cells(axis, at)).await
}

async fn regions(
    State(rooms): State<Rooms>,
    Query(CellsAt { axis, at }): Query<CellsAt>,
) -> Response {
    looked(rooms, move |shown| shown.regions(axis, at)).await
}

async fn surface(State(rooms): State<Rooms>) -> Response {
    looked(rooms, |shown| shown.surface()).await
}

async fn playback(State(rooms): State<Rooms>) -> Response {
    looked(rooms, |shown| shown.playback()).await
}

/// Looks at what is shown, on a thread of its own; nothing found is no content.
async fn looked(
    rooms: Rooms,
    look: impl FnOnce(&dyn crate::exhibit::Exhibit) -> Option<Vec<u8>> + Send + 'static,
) -> Response {
    let found = tokio::task::spawn_blocking(move || {
        rooms.hub.shown().and_then(|shown| look(shown.as_ref()))
    });
    match found.await {
        Ok(Some(bytes)) => octets(bytes),
        Ok(None) => StatusCode::NO_CONTENT.into_response(),
        Err(_) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

fn octets(bytes: Vec<u8>) -> Response {
    ([(CONTENT_TYPE, "application/octet-stream")], Bytes::from(bytes)).into_response()
}

#[derive(Debug, Deserialize)]
struct Named {
    name: String,
}

/// Keeps a dropped image in the session's folder and opens it.
async fn drop_image(
    State(rooms): State<Rooms>,
    Query(Named { name }): Query<Named>,
    body: Body,
) -> Response {
    let mut number = rooms.files.lock().await;
    let plain = plain_name(&name);
    if plain.is_empty() {
        return refused(StatusCode::BAD_REQUEST, "the file has no name");
    }
    // names of earlier images stay theirs, over restarts too
    let name = loop {
        *number += 1;
        let name = format!("dropped-{number}-{plain}");
        if !rooms.folder.join(&name).exists() {
            break name;
        }
    };
    let path = rooms.folder.join(&name);
    let received = tokio::time::timeout(DROP_TIME, receive(body, &path)).await;
    let kept = received.unwrap_or_else(|_| Err("the image took too long to arrive".into()));
    if let Err(why) = kept {
        let _ = std::fs::remove_file(&path);
        return refused(StatusCode::PAYLOAD_TOO_LARGE, why);
    }
    let (reply, opened) = oneshot::channel();
    rooms.engine.ask(Request::OpenDropped {
        name,
        run: Box::new(RunConfig::default()),
        reply: Box::new(|opened| drop(reply.send(opened))),
    });
    match opened.await {
        Ok(Ok(_)) => StatusCode::NO_CONTENT.into_response(),
        Ok(Err(why)) => {
            let _ = std::fs::remove_file(&path);
            refused(StatusCode::UNPROCESSABLE_ENTITY, why)
        }
        Err(_) => StatusCode::SERVICE_UNAVAILABLE.into_response(),
    }
}

#[derive(Debug, Deserialize)]
struct Format {
    format: String,
}

/// Writes the mesh into the session's folder and sends it.
async fn export(State(rooms): State<Rooms>, Query(Format { format }): Query<Format>) -> Response {
    let format: Export = match format.parse() {
        Ok(format) => format,
        Err(why) => return refused(StatusCode::BAD_REQUEST, why),
    };
    let _one = rooms.files.lock().await;
    let (reply, written) = oneshot::channel();
    let reply = Box::new(|written| drop(reply.send(written)));
    rooms.engine.ask(Request::Export { format, reply });
    let path: PathBuf = match written.await {
        Ok(Ok(path)) => path,
        Ok(Err(why)) => return refused(StatusCode::UNPROCESSABLE_ENTITY, why),
        Err(_) => return StatusCode::SERVICE_UNAVAILABLE.into_response(),
    };
    match tokio::task::spawn_blocking(move || std::fs::read(path)).await {
        Ok(Ok(bytes)) => {
            let mut headers = HeaderMap::new();
            let name = format!("attachment; filename=\"{}\"", format.file_name());
            if let Ok(value) = HeaderValue::from_str(&name) {
                headers.insert(CONTENT_DISPOSITION, value);
            }
            (headers, octets(bytes)).into_response()
        }
        _ => refused(StatusCode::INTERNAL_SERVER_ERROR, "the file cannot be read again"),
    }
}

fn refused(status: StatusCode, why: impl Into<String>) -> Response {
    (status, why.into()).into_response()
}
