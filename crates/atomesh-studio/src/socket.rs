//! A page's WebSocket: commands in, answers and the newest frames out.
//!
//! A frame of a kind is sent when the last one of that kind was acknowledged. Commands are read as long as few of them wait
//! for their answers. So a page that stalls costs one frame of each kind, and one that floods is heard no faster than it is
//! answered; one that sends more than a hand can is sent away.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use serde_json::json;
use tokio::sync::mpsc;

use crate::engine::Request;
use crate::hub::{Frame, Hub};
use crate::protocol::{Answer, Command, Kind, Numbered};
use crate::routes::Rooms;

/// Pages that may be open at a time.
pub const MOST_PAGES: usize = 8;

/// Bytes of the largest message from a page: a long gesture.
pub const MOST_BYTES: usize = 1 << 18;

/// Commands that wait for their answers at most.
const MOST_WAITING: usize = 32;

/// Commands in a second at most; a mouse moves 125 times, some 1000 times.
const MOST_A_SECOND: u32 = 2000;

/// How long a page may take to take a message.
const SEND_TIME: Duration = Duration::from_secs(60);

/// Counts a page as long as it lives.
#[derive(Debug)]
pub struct Present(pub Arc<Hub>);

impl Drop for Present {
    fn drop(&mut self) {
        self.0.go();
    }
}

/// What was sent of a kind.
#[derive(Clone, Copy, Debug, Default)]
struct Sent {
    version: u64,
    is_awaited: bool,
}

/// A second's worth of commands.
#[derive(Debug)]
struct Pace {
    since: Instant,
    count: u32,
}

impl Pace {
    fn is_kept(&mut self) -> bool {
        if self.since.elapsed() >= Duration::from_secs(1) {
            *self = Self { since: Instant::now(), count: 0 };
        }
        self.count += 1;
        self.count <= MOST_A_SECOND
    }
}

/// Serves a page until it goes.
pub async fn serve(mut socket: WebSocket, rooms: Rooms, present: Present) {
    let mut news = rooms.hub.subscribe();
    let (answer, mut answers) = mpsc::unbounded_channel::<Answer>();
    let (mut sent, mut waiting) = (HashMap::<Kind, Sent>::new(), 0);
    let mut pace = Pace { since: Instant::now(), count: 0 };
    news.mark_changed();
    loop {
        tokio::select! {
            message = socket.recv(), if waiting < MOST_WAITING => {
                let text = match message {
                    Some(Ok(Message::Text(text))) => text,
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
                    Some(Ok(Message::Binary(_))) => {
                        leave(socket, close_code::UNSUPPORTED, "commands are text").await;
                        break;
                    }
                    Some(Ok(Message::Close(_)) | Err(_)) | None => break,
                };
                if !pace.is_kept() {
                    leave(socket, close_code::POLICY, "too many commands").await;
                    break;
                }
                match Numbered::parse(&text) {
                    Ok(Numbered { command: Command::Ack { kind }, .. }) => {
                        sent.entry(kind).or_default().is_awaited = false;
                        if send_news(&mut socket, &rooms.hub, &mut sent).await.is_err() {
                            break;
                        }
                    }
                    Ok(Numbered { seq, command }) => {
                        waiting += 1;
                        let answer = answer.clone();
                        rooms.engine.ask(Request::Command(command, Box::new(move |done| {
                            let (text, refused) = match done {
                                Ok(text) => (text, None),
                                Err(why) => (None, Some(why)),
                            };
                            let _ = answer.send(Answer { seq, refused, text });
                        })));
                    }
                    Err(why) => {
                        leave(socket, close_code::INVALID, &why.to_string()).await;
                        break;
                    }
                }
            }
            Some(answer) = answers.recv() => {
                waiting -= 1;
                let text = serde_json::to_string(&answer).unwrap_or_default();
                if send(&mut socket, Message::Text(text.into())).await.is_err() {
                    break;
                }
            }
            changed = news.changed() => {
                if changed.is_err() || send_news(&mut socket, &rooms.hub, &mut sent).await.is_err() {
                    break;
                }
            }
        }
    }
    drop(present);
}

/// The page is gone, or takes nothing any more.
struct Gone;

async fn send(socket: &mut WebSocket, message: Message) -> Result<(), Gone> {
    match tokio::time::timeout(SEND_TIME, socket.send(message)).await {
        Ok(Ok(())) => Ok(()),
        _ => Err(Gone),
    }
}

/// Sends what is newer than what was sent, of kinds whose last frame was acknowledged.
async fn send_news(
    socket: &mut WebSocket,
    hub: &Hub,
    sent: &mut HashMap<Kind, Sent>,
) -> Result<(), Gone> {
    let than = |kind: Kind| {
        let Sent { version, is_awaited } = sent.get(&kind).copied().unwrap_or_default();
        (!is_awaited).then_some(version)
    };
    for (kind, version, frame) in hub.newer(than) {
        let message = match frame {
            Frame::Text(text) => {
                let head = json!({ "kind": kind, "version": version }).to_string();
                // the state is JSON already: it is not taken apart to be wrapped
                let open = head.trim_end_matches('}');
                Message::Text(format!("{open},\"value\":{text}}}").into())
            }
            Frame::Binary(bytes) => Message::Binary(bytes),
        };
        send(socket, message).await?;
        sent.insert(kind, Sent { version, is_awaited: true });
    }
    Ok(())
}

/// Says why, and closes.
async fn leave(mut socket: WebSocket, code: u16, why: &str) {
    let reason: String = why.chars().take(100).collect();
    let frame = CloseFrame { code, reason: reason.into() };
    let _ = send(&mut socket, Message::Close(Some(frame))).await;
}
