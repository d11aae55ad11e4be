//! The WebSocket of the open page: a reader and a writer of one connection.

use super::hub::{Hub, Next};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

/// Appended to the key of a handshake (RFC 6455, section 1.3).
const MAGIC: &str = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
/// Largest message of a page (bytes).
const LARGEST: usize = 1 << 16;
/// A page that takes nothing for this long is gone.
const PATIENCE: Duration = Duration::from_secs(30);

/// The answer to the key of a handshake.
pub fn accept(key: &str) -> String {
    STANDARD.encode(sha1_smol::Sha1::from(format!("{key}{MAGIC}")).digest().bytes())
}

/// The half that is read. What the protocol would write, such as answers to a closing page, is dropped: all bytes that
/// are sent come from the writer.
struct Reader(TcpStream);

impl Read for Reader {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for Reader {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Serves a page until it is closed or another one is opened.
pub fn serve(stream: TcpStream, hub: &Hub) {
    let settled = stream.set_read_timeout(None).and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
    let (Ok(()), Ok(()), Ok(half)) = (settled, stream.set_nodelay(true), stream.try_clone()) else { return };
    let number = hub.enter();
    let own = hub.clone();
    let writer = std::thread::spawn(move || write(half, &own, number));
    read(stream, hub, number);
    hub.leave(number);
    let _ = writer.join();
}

/// Passes messages on until the page is closed, or sends what no page of ours sends.
fn read(stream: TcpStream, hub: &Hub, number: u64) {
    let limits = WebSocketConfig::default().max_message_size(Some(LARGEST)).max_frame_size(Some(LARGEST));
    let mut socket = WebSocket::from_raw_socket(Reader(stream), Role::Server, Some(limits));
    loop {
        match socket.read() {
            Ok(Message::Text(text)) if hub.receive(number, &text).is_ok() => {}
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            _ => break,
        }
    }
    let _ = socket.get_ref().0.shutdown(Shutdown::Both);
}

/// Sends texts and frames until the page is closed or another one is opened.
fn write(stream: TcpStream, hub: &Hub, number: u64) {
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, None);
    while let Some(next) = hub.next(number) {
        let message = match next {
            Next::Text(text) => Message::text(text),
            Next::Frame(frame) => Message::binary(frame),
        };
        if socket.send(message).is_err() {
            break;
        }
    }
    let _ = socket.close(None).and_then(|()| socket.flush());
    let _ = socket.get_ref().shutdown(Shutdown::Both);
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_key_of_the_standard_has_the_answer_of_the_standard() {
        assert_eq!(super::accept("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
    }
}
