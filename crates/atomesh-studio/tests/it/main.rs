//! The studio as its users meet it: a running server, and a real browser where there is one.

mod browser;
mod chromium;
mod client;
mod edits;
mod regions;
mod security;
