//! Who may speak to the studio: decided here, before any routing, for every request alike.
//!
//! The server listens on the loopback, where any program and any page of any site can reach it. A request passes if
//!
//! 1. its method is GET or POST;
//! 2. its `Host` is one of the three spellings of this server, as a whole string. A name that an attacker makes resolve
//!    to 127.0.0.1 (rebinding) is none of them;
//! 3. no browser says that another site or port asked for it (`Sec-Fetch-Site`), and where something may change (POST,
//!    WebSocket) its `Origin` is this server's;
//! 4. it carries the session's cookie, or it is the one request that exchanges the token of the opened address for the
//!    cookie.
//!
//! Cookies do not know ports: a page of another server on this machine may send ours along. Therefore 3 is asked of every
//! request, and the cookie is named with the port. Secrets are 256 random bits, live in memory only, and are compared in
//! constant time. Every answer, refusals too, carries the headers of [`HEADERS`].

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, COOKIE, HOST, HeaderName, HeaderValue, ORIGIN,
    REFERRER_POLICY, SET_COOKIE, UPGRADE, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::request::Parts;
use axum::http::{HeaderMap, Method, StatusCode};

/// The content security policy: nothing but this server's own files, pictures made by the page, and no frame around it.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
                      img-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The headers of every answer.
pub const HEADERS: [(HeaderName, &str); 6] = [
    (CONTENT_SECURITY_POLICY, POLICY),
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (REFERRER_POLICY, "no-referrer"),
    (CACHE_CONTROL, "no-store"),
];

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// A method other than GET and POST.
    #[error("expected GET or POST")]
    Method,
    /// A `Host` that is not this server's.
    #[error("this address is not the studio's")]
    Host,
    /// A request that another site, or another port of this machine, asked for.
    #[error("another site asked for this")]
    Origin,
    /// Neither the cookie nor the token.
    #[error(
        "this browser does not belong to the session. The address that the command prints opens once; start \
         `atomesh studio` again to open another browser"
    )]
    Stranger,
}

impl Refusal {
    /// The status of the answer.
    pub fn status(self) -> StatusCode {
        match self {
            Self::Method => StatusCode::METHOD_NOT_ALLOWED,
            Self::Host => StatusCode::MISDIRECTED_REQUEST,
            Self::Origin | Self::Stranger => StatusCode::FORBIDDEN,
        }
    }
}

/// What a request that passes may do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pass {
    /// It belongs to the session.
    Session,
    /// It has brought the token: it is answered by a redirect to `/` with this cookie, or with none where it has the
    /// cookie already.
    Exchange(Option<String>),
}

/// Decides who passes.
#[derive(Debug)]
pub struct Gate {
    hosts: [String; 3],
    cookie_name: String,
    token: Secret,
    is_spent: AtomicBool,
    cookie: Secret,
    /// The one exchange at a time.
    exchange: Mutex<()>,
}

impl Gate {
    /// A gate for the server on this port, with new secrets.
    ///
    /// # Errors
    /// [`getrandom::Error`] if the system gives no random numbers.
    pub fn new(port: u16) -> Result<Self, getrandom::Error> {
        Ok(Self {
            hosts: ["127.0.0.1", "[::1]", "localhost"].map(|name| format!("{name}:{port}")),
            cookie_name: format!("atomesh-{port}"),
            token: Secret::new()?,
            is_spent: AtomicBool::new(false),
            cookie: Secret::new()?,
            exchange: Mutex::new(()),
        })
    }

    /// The address to open, with the token.
    pub fn address(&self) -> String {
        format!("http://{}/?token={}", self.hosts[0], self.token.0)
    }

    /// Whether a request passes.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn check(&self, request: &Parts) -> Result<Pass, Refusal> {
        let Parts { method, uri, headers, .. } = request;
        if !(method == Method::GET || method == Method::POST) {
            return Err(Refusal::Method);
        }
        let host = only(headers, &HOST).filter(|host| self.hosts.iter().any(|own| own == host));
        let host = host.ok_or(Refusal::Host)?;
        // an absolute address in the first line goes before the header
        if uri.authority().is_some_and(|authority| authority.as_str() != host) {
            return Err(Refusal::Host);
        }
        let site = headers.get(SEC_FETCH_SITE).map(HeaderValue::as_bytes);
        if !matches!(site, None | Some(b"same-origin" | b"none")) {
            return Err(Refusal::Origin);
        }
        let changes = method != Method::GET || headers.contains_key(UPGRADE);
        let is_own = only(headers, &ORIGIN)
            .is_some_and(|origin| origin.strip_prefix("http://") == Some(host));
        if (changes || headers.contains_key(ORIGIN)) && !is_own {
            return Err(Refusal::Origin);
        }
        let token = uri.query().and_then(|query| query.strip_prefix("token="));
        let is_known = self.has_cookie(headers);
        match token.filter(|_| method == Method::GET && uri.path() == "/") {
            Some(_) if is_known => Ok(Pass::Exchange(None)),
            Some(token) => self.take(token).map(|cookie| Pass::Exchange(Some(cookie))),
            None if is_known => Ok(Pass::Session),
            None => Err(Refusal::Stranger),
        }
    }

    /// The cookie for the token, which is spent by it.
    fn take(&self, token: &str) -> Result<String, Refusal> {
        let _alone = self.exchange.lock();
        if !self.token.is(token) || self.is_spent.swap(true, Ordering::SeqCst) {
            return Err(Refusal::Stranger);
        }
        let Self { cookie_name, cookie, .. } = self;
        Ok(format!("{cookie_name}={}; HttpOnly; SameSite=Strict; Path=/", cookie.0))
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let texts = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut pairs =
            texts.flat_map(|text| text.split(';')).filter_map(|p| p.trim().split_once('='));
        pairs.any(|(name, value)| name == self.cookie_name && self.cookie.is(value))
    }
}

/// The headers that an answer gets, whatever it is.
pub fn finish(headers: &mut HeaderMap, cookie: Option<&str>) {
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if let Some(cookie) = cookie.and_then(|text| HeaderValue::from_str(text).ok()) {
        headers.insert(SET_COOKIE, cookie);
    }
}

/// The text of a header that is there once.
fn only<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    let mut all = headers.get_all(name).iter();
    let first = all.next()?;
    all.next().is_none().then(|| first.to_str().ok()).flatten()
}

/// 256 random bits as hexadecimal digits.
struct Secret(String);

impl Secret {
    fn new() -> Result<Self, getrandom::Error> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes)?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Whether this is the secret, in a time that does not depend on where the two differ.
    fn is(&self, text: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), text.as_bytes());
        let differ = own.iter().zip(other).fold(0, |differ, (a, b)| differ | (a ^ b));
        own.len() == other.len() && std::hint::black_box(differ) == 0
    }
}

/// No secret is ever printed.
impl std::fmt::Debug for Secret {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("…")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::Request;

    fn parts(method: &str, uri: &str, headers: &[(&str, &str)]) -> Parts {
        let mut request = Request::builder().method(method).uri(uri);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        request.body(()).unwrap().into_parts().0
    }

    fn cookie_of(gate: &Gate) -> String {
        let token = gate.address().split_once("/?").unwrap().1.to_owned();
        let request = parts("GET", &format!("/?{token}"), &[("host", "127.0.0.1:80")]);
        let Ok(Pass::Exchange(Some(cookie))) = gate.check(&request) else { panic!("no cookie") };
        cookie.split(';').next().unwrap().to_owned()
    }

    #[test]
    fn secrets_differ_and_are_never_printed() {
        let gate = Gate::new(80).unwrap();
        let token = gate.address().split_once('=').unwrap().1.to_owned();
        assert_eq!(token.len(), 64);
        assert!(!cookie_of(&gate).contains(&token), "the token is no cookie");
        assert!(!format!("{gate:?}").contains(&token));
        assert_ne!(gate.address(), Gate::new(80).unwrap().address());
    }

    #[test]
    fn a_secret_is_the_whole_of_it() {
        let secret = Secret::new().unwrap();
        let text = secret.0.clone();
        assert!(secret.is(&text));
        assert!(!secret.is("") && !secret.is(&text[1..]) && !secret.is(&format!("{text}0")));
        let other = if text.starts_with('0') { "1" } else { "0" };
        assert!(!secret.is(&format!("{other}{}", &text[1..])));
    }

    #[test]
    fn one_header_too_many_is_as_none() {
        let gate = Gate::new(80).unwrap();
        let cookie = cookie_of(&gate);
        let twice = [("host", "127.0.0.1:80"), ("host", "127.0.0.1:80"), ("cookie", &cookie)];
        assert_eq!(gate.check(&parts("GET", "/", &twice)), Err(Refusal::Host));
        let absolute = [("host", "127.0.0.1:80"), ("cookie", &cookie)];
        assert_eq!(gate.check(&parts("GET", "http://evil.test/", &absolute)), Err(Refusal::Host));
        assert_eq!(gate.check(&parts("GET", "http://127.0.0.1:80/", &absolute)), Ok(Pass::Session));
    }
}
