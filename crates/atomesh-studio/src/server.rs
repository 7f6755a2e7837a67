//! The server: on 127.0.0.1 and ::1 alone, on a port that the system chooses, until nobody looks any more.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::LOCATION;
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::sync::Semaphore;

use crate::engine::{self, Handle};
use crate::hub::Hub;
use crate::routes::{self, Rooms};
use crate::security::{Gate, Pass, finish};
use crate::session::Session;

/// Connections that are open at a time; a browser opens six, and one for the WebSocket.
const MOST_CONNECTIONS: usize = 64;

/// How long a request may take to say what it wants.
const HEAD_TIME: Duration = Duration::from_secs(10);

/// From one look at who is there to the next.
const LOOK: Duration = Duration::from_millis(100);

/// How often another port is tried, where ::1 has not the same free.
const PORTS_TRIED: usize = 16;

/// A server that listens and does not answer yet.
#[derive(Debug)]
pub struct Server {
    listeners: Vec<TcpListener>,
    gate: Arc<Gate>,
    session: Session,
    patience: Duration,
}

impl Server {
    /// Listens for a session, on a new port with new secrets. After `patience` without a page [`Server::run`] ends.
    ///
    /// # Errors
    /// [`io::Error`] if the loopback cannot be listened on, or the system has no random numbers.
    pub fn new(session: Session, patience: Duration) -> io::Result<Self> {
        let listeners = listen()?;
        let port = listeners[0].local_addr()?.port();
        let gate = Arc::new(Gate::new(port).map_err(io::Error::other)?);
        Ok(Self { listeners, gate, session, patience })
    }

    /// The address to open. It holds the token, opens once, and is to be shown to the user alone.
    pub fn address(&self) -> String {
        self.gate.address()
    }

    /// The addresses that are listened on.
    pub fn listens_on(&self) -> Vec<SocketAddr> {
        self.listeners.iter().filter_map(|listener| listener.local_addr().ok()).collect()
    }

    /// Serves until `is_ended` says so, or no page was open for as long as the server is patient.
    ///
    /// # Errors
    /// [`io::Error`] if the system fails the server.
    pub fn run(self, is_ended: impl Fn() -> bool) -> io::Result<()> {
        let Self { listeners, gate, session, patience } = self;
        let hub = Arc::new(Hub::default());
        let folder = session.folder().to_path_buf();
        let (engine, thread) = engine::start(session, hub.clone());
        let rooms = Rooms::new(hub.clone(), engine.clone(), folder);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let served = runtime.block_on(async {
            let app = guarded(gate, routes::router(rooms));
            let free = Arc::new(Semaphore::new(MOST_CONNECTIONS));
            for listener in listeners {
                listener.set_nonblocking(true)?;
                let listener = tokio::net::TcpListener::from_std(listener)?;
                tokio::spawn(accept(listener, app.clone(), free.clone()));
            }
            while !is_ended() && hub.deserted() <= patience {
                tokio::time::sleep(LOOK).await;
            }
            Ok(())
        });
        runtime.shutdown_background();
        end(&engine);
        // a panic of the engine was reported by its thread
        let _ = thread.join();
        served
    }
}

fn end(engine: &Handle) {
    engine.ask(engine::Request::End);
}

/// Listens on one port of 127.0.0.1 and, where there is IPv6, of ::1.
fn listen() -> io::Result<Vec<TcpListener>> {
    for _ in 0..PORTS_TRIED {
        let first = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        match TcpListener::bind((Ipv6Addr::LOCALHOST, first.local_addr()?.port())) {
            Ok(second) => return Ok(vec![first, second]),
            Err(e) if e.kind() == io::ErrorKind::AddrInUse => {}
            Err(_) => return Ok(vec![first]), // there is no IPv6 here
        }
    }
    Err(io::Error::from(io::ErrorKind::AddrInUse))
}

/// Takes connections, as many at a time as may be.
async fn accept(listener: tokio::net::TcpListener, app: Router, free: Arc<Semaphore>) {
    loop {
        let Ok(place) = free.clone().acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            // the system is short of something: it may come back
            tokio::time::sleep(LOOK).await;
            continue;
        };
        let service = TowerToHyperService::new(app.clone());
        tokio::spawn(async move {
            let _place = place;
            let mut server = http1::Builder::new();
            server.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME);
            // who breaks off wants no answer
            let _ = server.serve_connection(TokioIo::new(stream), service).with_upgrades().await;
        });
    }
}

/// The routes behind the gate: nothing is routed before it is asked, and no answer lacks its headers.
fn guarded(gate: Arc<Gate>, inner: Router) -> Router {
    Router::new().fallback_service(inner).layer(from_fn_with_state(gate, guard))
}

async fn guard(State(gate): State<Arc<Gate>>, request: Request, next: Next) -> Response {
    let (head, body) = request.into_parts();
    let (mut response, cookie) = match gate.check(&head) {
        Ok(Pass::Session) => (next.run(Request::from_parts(head, body)).await, None),
        Ok(Pass::Exchange(cookie)) => {
            let mut response = Response::new(Body::empty());
            *response.status_mut() = StatusCode::SEE_OTHER;
            response.headers_mut().insert(LOCATION, HeaderValue::from_static("/"));
            (response, cookie)
        }
        Err(refusal) => ((refusal.status(), refusal.to_string()).into_response(), None),
    };
    finish(response.headers_mut(), cookie.as_deref());
    response
}
