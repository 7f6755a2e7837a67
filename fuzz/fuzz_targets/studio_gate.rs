//! Any request: without the secrets none passes.
#![no_main]

use atomesh_studio::security::Gate;
use http::{Method, Request};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (&[u8], &str, Vec<(&str, &[u8])>)| {
    let (method, uri, headers) = input;
    let gate = Gate::new(4321).unwrap();
    let Ok(method) = Method::from_bytes(method) else { return };
    let mut request = Request::builder().method(method).uri(uri).header("host", "127.0.0.1:4321");
    for (name, value) in headers {
        request = request.header(name, value);
    }
    let Ok(request) = request.body(()) else { return };
    let (head, ()) = request.into_parts();
    assert!(gate.check(&head).is_err());
});
