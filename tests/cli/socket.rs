//! A client of HTTP and WebSockets on this machine.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use tungstenite::WebSocket;
use tungstenite::protocol::Role;

/// Sends a request with these headers and returns the connection and the head of the response.
fn request(host: &str, first: &str, headers: &[(&str, &str)]) -> (BufReader<TcpStream>, String) {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let lines: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    stream.write_all(format!("{first} HTTP/1.1\r\n{lines}\r\n").as_bytes()).unwrap();
    let (mut reader, mut head) = (BufReader::new(stream), String::new());
    while !head.ends_with("\r\n\r\n") && reader.read_line(&mut head).unwrap() > 0 {}
    (reader, head)
}

/// Status, head and body of a response.
pub fn fetch(host: &str, first: &str, headers: &[(&str, &str)]) -> (u16, String, String) {
    let (mut reader, head) = request(host, first, headers);
    let mut body = String::new();
    reader.read_to_string(&mut body).unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), head, body)
}

/// Opens a WebSocket. Errors: the head of a response that does not open one.
pub fn connect(host: &str, path: &str, origin: Option<&str>) -> Result<WebSocket<TcpStream>, String> {
    let mut headers = vec![
        ("Host", host),
        ("Connection", "Upgrade"),
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
    ];
    headers.extend(origin.map(|origin| ("Origin", origin)));
    let (reader, head) = request(host, &format!("GET {path}"), &headers);
    if !head.starts_with("HTTP/1.1 101") {
        return Err(head);
    }
    let read = reader.buffer().to_vec();
    Ok(WebSocket::from_partially_read(reader.into_inner(), read, Role::Client, None))
}
