//! Standard input and stop requests, on one channel.

use std::io::{self, Read};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use crate::Error;

/// Bytes read at once.
const CHUNK: usize = 64 * 1024;
/// Capacity of the queue of chunks.
const WAITING: usize = 4;

/// Input event.
pub(super) enum Event {
    /// Some bytes.
    Bytes(Vec<u8>),
    /// End of the input.
    End,
    /// Reading has failed.
    Failed(io::Error),
    /// The program is asked to stop (interrupt, termination).
    Stop,
}

/// Reads standard input in a separate thread, so that a stop request is handled while no row comes.
pub(super) fn open() -> Result<Receiver<Event>, Error> {
    let (sender, receiver) = sync_channel(WAITING);
    let stop = sender.clone();
    ctrlc::set_handler(move || {
        // The receiver has already stopped.
        let _ = stop.send(Event::Stop);
    })
    .map_err(|error| {
        Error::Usage(format!(
            "the interrupt cannot be caught: {error}; only one monitor may run in a process"
        ))
    })?;
    thread::spawn(move || read(&sender));
    Ok(receiver)
}

fn read(sender: &SyncSender<Event>) {
    let mut input = io::stdin().lock();
    loop {
        let mut bytes = vec![0; CHUNK];
        let event = match input.read(&mut bytes) {
            Ok(0) => Event::End,
            Ok(n) => {
                bytes.truncate(n);
                Event::Bytes(bytes)
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => Event::Failed(error),
        };
        let more = matches!(event, Event::Bytes(_));
        if sender.send(event).is_err() || !more {
            return;
        }
    }
}
