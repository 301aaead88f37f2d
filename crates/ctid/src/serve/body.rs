//! Reading of a request's body, with limits for its size, its transfer time, and the total of all transfers.

use std::future::poll_fn;
use std::pin::Pin;
use std::time::Duration;

use axum::body::{Body, Bytes, HttpBody};
use axum::http::StatusCode;
use tokio::sync::{Semaphore, SemaphorePermit};
use tokio::time::timeout;

use super::guard::Refusal;

/// Time limit between two parts of a body.
const LONGEST_SILENCE: Duration = Duration::from_secs(10);
/// Time limit for receiving a whole body.
const LONGEST: Duration = Duration::from_secs(60);

/// Reads the body within the memory limit for transfers, with a permit for each byte. If there is not enough memory, the request is
/// rejected at once.
pub(super) async fn whole<'a>(
    body: Body,
    most: usize,
    room: &'a Semaphore,
    too_large: fn() -> Refusal,
) -> Result<(Bytes, SemaphorePermit<'a>), Refusal> {
    let late = |_| {
        Refusal::new(
            StatusCode::REQUEST_TIMEOUT,
            "the file did not arrive within a minute, or stopped for ten seconds; copy it to this machine and drop it again",
        )
    };
    timeout(LONGEST, parts(body, most, room, too_large, LONGEST_SILENCE))
        .await
        .map_err(late)?
}

async fn parts<'a>(
    mut body: Body,
    most: usize,
    room: &'a Semaphore,
    too_large: fn() -> Refusal,
    silence: Duration,
) -> Result<(Bytes, SemaphorePermit<'a>), Refusal> {
    let full = |_| {
        Refusal::new(
            StatusCode::SERVICE_UNAVAILABLE,
            "too many files are being transferred at once; drop it again when the others have arrived",
        )
    };
    let broken = |_| Refusal::input("the transfer of the file was interrupted; drop it again");
    let mut content = Vec::new();
    let mut share = room.try_acquire_many(0).map_err(full)?;
    loop {
        let next = poll_fn(|context| Pin::new(&mut body).poll_frame(context));
        let next = timeout(silence, next).await.map_err(|_| {
            Refusal::new(
                StatusCode::REQUEST_TIMEOUT,
                "the transfer of the file stalled; copy it to this machine and drop it again",
            )
        })?;
        let Some(frame) = next.transpose().map_err(broken)? else {
            return Ok((content.into(), share));
        };
        let Ok(data) = frame.into_data() else {
            continue;
        };
        if content.len() + data.len() > most {
            return Err(too_large());
        }
        // A part is far smaller than 4 GB.
        let bytes = u32::try_from(data.len()).unwrap_or(u32::MAX);
        share.merge(room.try_acquire_many(bytes).map_err(full)?);
        content.extend_from_slice(&data);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn read(body: Body, most: usize, room: &Semaphore) -> Result<Bytes, String> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap();
        let silence = Duration::from_millis(50);
        let read = parts(body, most, room, Refusal::too_large, silence);
        let read = runtime.block_on(read);
        read.map(|(content, _)| content)
            .map_err(|refusal| refusal.to_string())
    }

    /// A body without any data.
    struct Silent;

    impl HttpBody for Silent {
        type Data = Bytes;
        type Error = std::convert::Infallible;

        fn poll_frame(
            self: Pin<&mut Self>,
            _: &mut std::task::Context<'_>,
        ) -> std::task::Poll<Option<Result<hyper::body::Frame<Bytes>, Self::Error>>> {
            std::task::Poll::Pending
        }
    }

    #[test]
    fn a_body_is_read_up_to_its_bound() {
        let room = Semaphore::new(100);
        let content = || Body::from("0123456789");
        assert_eq!(read(content(), 10, &room).unwrap(), "0123456789");
        assert!(read(content(), 9, &room).unwrap_err().contains("64 MB"));
        assert_eq!(room.available_permits(), 100, "the room is given back");
        let full = read(content(), 10, &Semaphore::new(9)).unwrap_err();
        assert!(full.contains("at once"), "{full}");
    }

    #[test]
    fn a_body_that_never_comes_is_not_waited_for() {
        let room = Semaphore::new(100);
        let silent = read(Body::new(Silent), 10, &room).unwrap_err();
        assert!(silent.contains("stalled"), "{silent}");
    }
}
