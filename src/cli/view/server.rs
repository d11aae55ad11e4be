//! A server for one page, on the loopback interface.
//!
//! Every path starts with a random token, so that other users and other pages on this machine cannot guess it. A
//! request whose `Host` or `Origin` is not this server is refused: another site's script that reaches the port by a
//! name of its own is stopped there. Everything served is in memory, and the page may connect to nothing else.

use super::hub::Hub;
use super::socket;
use crate::lab::error::Error;
use rand::TryRng;
use rand::rngs::SysRng;
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = concat!(include_str!("../../lab/recording/draw.js"), include_str!("page.js"));

/// Largest head of a request (bytes), and number of its lines.
const LARGEST_HEAD: usize = 8192;
const MOST_HEADERS: usize = 64;
/// Time within which a request has to arrive.
const PATIENCE: Duration = Duration::from_secs(5);
/// Most requests at the same time.
const MOST_REQUESTS: usize = 16;

/// An open port with its token.
pub struct Door {
    listener: TcpListener,
    guard: Arc<Guard>,
    hub: Hub,
}

/// What a request is checked against.
struct Guard {
    port: u16,
    token: String,
    requests: AtomicUsize,
}

/// The lines of a request that matter.
struct Head {
    method: String,
    path: String,
    host: String,
    origin: Option<String>,
    /// The key of a WebSocket handshake.
    key: Option<String>,
}

/// A response without a body of its own: status and reason.
type Refusal = (u16, &'static str);

impl Door {
    /// Listens on 127.0.0.1. Errors: the port is taken; the system has no random numbers.
    pub fn open(port: u16, hub: Hub) -> Result<Self, Error> {
        let mut bytes = [0; 16];
        SysRng.try_fill_bytes(&mut bytes).map_err(|e| Error::invalid("token", e.to_string()))?;
        let token = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let place = PathBuf::from(format!("127.0.0.1:{port}"));
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(Error::io(&place))?;
        let port = listener.local_addr().map_err(Error::io(&place))?.port();
        Ok(Door { listener, guard: Arc::new(Guard { port, token, requests: AtomicUsize::new(0) }), hub })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.guard.port, self.guard.token)
    }

    /// Answers requests until the program ends.
    pub fn listen(self) {
        std::thread::spawn(move || {
            for stream in self.listener.incoming().flatten() {
                let (guard, hub) = (self.guard.clone(), self.hub.clone());
                if guard.requests.fetch_add(1, Ordering::Relaxed) >= MOST_REQUESTS {
                    guard.requests.fetch_sub(1, Ordering::Relaxed);
                    continue;
                }
                std::thread::spawn(move || {
                    let page = answer(stream, &guard, &hub);
                    guard.requests.fetch_sub(1, Ordering::Relaxed);
                    page.into_iter().for_each(|stream| socket::serve(stream, &hub));
                });
            }
        });
    }
}

/// Answers a request. Returns the connection if it has become a WebSocket.
fn answer(mut stream: TcpStream, guard: &Guard, hub: &Hub) -> Option<TcpStream> {
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    stream.set_write_timeout(Some(PATIENCE)).ok()?;
    let head = read_head(&mut stream);
    let found = head.and_then(|head| {
        let place = guard.check(&head)?;
        Ok((place.to_string(), head))
    });
    let (place, head) = match found {
        Ok(found) => found,
        Err((status, reason)) => {
            respond(&mut stream, guard, status, reason, "text/plain", reason);
            return None;
        }
    };
    let replay = hub.replay();
    match (place.as_str(), &head.key, &replay) {
        ("socket", Some(key), _) => {
            let accept = socket::accept(key);
            let text = format!(
                "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
                 Sec-WebSocket-Accept: {accept}\r\n\r\n"
            );
            return stream.write_all(text.as_bytes()).is_ok().then_some(stream);
        }
        ("", ..) => respond(&mut stream, guard, 200, "OK", "text/html", PAGE),
        ("page.css", ..) => respond(&mut stream, guard, 200, "OK", "text/css", STYLE),
        ("page.js", ..) => respond(&mut stream, guard, 200, "OK", "text/javascript", SCRIPT),
        ("replay.html", _, Some(page)) => {
            respond(&mut stream, guard, 200, "OK", "application/octet-stream", page);
        }
        _ => respond(&mut stream, guard, 404, "Not Found", "text/plain", "nothing is here"),
    }
    None
}

impl Guard {
    /// The path of a request without its token. Errors: it is not from this server's page.
    fn check<'h>(&self, head: &'h Head) -> Result<&'h str, Refusal> {
        let is_own = |name: &str| {
            ["127.0.0.1", "localhost"].iter().any(|host| name == format!("{host}:{}", self.port))
        };
        let from = head.origin.as_deref().map(|origin| origin.strip_prefix("http://").unwrap_or_default());
        if !is_own(&head.host) || from.is_some_and(|from| !is_own(from)) {
            return Err((403, "requests from elsewhere are refused"));
        }
        let path = head.path.strip_prefix('/').unwrap_or_default();
        let (token, place) = path.split_once('/').unwrap_or((path, ""));
        // Compared as a whole, in a time that does not tell how much of it is right.
        let differs = token.bytes().zip(self.token.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
        if token.len() != self.token.len() || differs != 0 || !path.contains('/') {
            return Err((403, "the address is not complete"));
        }
        match (head.method.as_str(), &head.key, &head.origin) {
            ("GET", Some(_), None) => Err((403, "a socket needs an origin")),
            ("GET", ..) => Ok(place),
            _ => Err((405, "only GET is answered")),
        }
    }
}

/// Reads a request up to the empty line.
fn read_head(stream: &mut TcpStream) -> Result<Head, Refusal> {
    let bad = |_| (400, "the request is damaged");
    let (mut bytes, mut part) = (Vec::new(), [0; 2 * LARGEST_HEAD]);
    loop {
        let count = match stream.read(&mut part) {
            Ok(0) => return Err((400, "the request is cut off")),
            Ok(count) => count,
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            Err(_) => return Err((408, "the request is too slow")),
        };
        bytes.extend(&part[..count]);
        if bytes.len() > LARGEST_HEAD {
            return Err((431, "the request is too long"));
        }
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        if request.parse(&bytes).map_err(bad)?.is_complete() {
            let all =
                |name: &str| request.headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name)).count();
            let of = |name: &str| {
                let header = request.headers.iter().find(|h| h.name.eq_ignore_ascii_case(name))?;
                Some(String::from_utf8_lossy(header.value).into_owned())
            };
            if all("host") != 1 || all("origin") > 1 {
                return Err((400, "the request is damaged"));
            }
            let upgrades = of("upgrade").is_some_and(|to| to.eq_ignore_ascii_case("websocket"));
            return Ok(Head {
                method: request.method.unwrap_or_default().into(),
                path: request.path.unwrap_or_default().into(),
                host: of("host").unwrap_or_default(),
                origin: of("origin"),
                key: of("sec-websocket-key").filter(|_| upgrades),
            });
        }
    }
}

/// Sends a response and ends the connection; write errors are those of a page that is gone.
fn respond(stream: &mut TcpStream, guard: &Guard, status: u16, reason: &str, kind: &str, body: &str) {
    let port = guard.port;
    let head = format!(
        "HTTP/1.1 {status} {reason}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {}\r\n\
         Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; \
         connect-src 'self' ws://127.0.0.1:{port} ws://localhost:{port}; base-uri 'none'; form-action 'none'; \
         frame-ancestors 'none'\r\n\r\n",
        body.len()
    );
    let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body.as_bytes()));
    let _ = stream.shutdown(Shutdown::Write);
}
