//! Requests to the page as bytes, and what comes back.

use std::io::{Read, Result, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Received bytes until the connection was closed or the time had passed.
#[derive(Debug)]
pub struct Answer {
    /// `None` without a valid answer.
    pub status: Option<u16>,
    /// Its head.
    pub head: String,
    /// Body of the answer.
    pub body: String,
}

/// Sends bytes and reads to the end, at most `patience` from one part to the next.
///
/// # Errors
/// Where there is no connection.
pub fn exchange(address: impl ToSocketAddrs, bytes: &[u8], patience: Duration) -> Result<Answer> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(patience))?;
    // A server that has already rejected the request does not read the rest.
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let mut part = [0; 1 << 16];
    while let Ok(count @ 1..) = stream.read(&mut part) {
        answer.extend_from_slice(&part[..count]);
    }
    let text = String::from_utf8_lossy(&answer);
    let (head, body) = text.split_once("\r\n\r\n").unwrap_or_default();
    let status = head.split(' ').nth(1);
    Ok(Answer {
        status: status.and_then(|status| status.parse().ok()),
        head: head.to_string(),
        body: body.to_string(),
    })
}
