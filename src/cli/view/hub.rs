//! What the session and the open page pass to each other.

use crate::lab::view::Request;
use serde::Deserialize;
use std::collections::VecDeque;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Frames that are on their way to the page or not yet drawn.
const IN_FLIGHT: u32 = 2;

/// Something that the session has to know.
#[derive(Debug)]
pub enum Event {
    /// A page was opened.
    Opened,
    /// The page has drawn a frame.
    Ready,
    /// Play or pause, and how fast.
    Play(Playback),
    /// One step.
    Step,
    /// A request of the page to the session.
    Session(Request),
}

/// Whether and how fast a session plays.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Playback {
    /// Whether it plays.
    pub on: bool,
    /// Simulated seconds per second.
    pub speed: f64,
    /// Whether the page waits for the stage.
    #[serde(skip)]
    pub is_opened: bool,
}

impl Default for Playback {
    fn default() -> Self {
        Playback { on: true, speed: 1.0, is_opened: false }
    }
}

/// Range of [`Playback::speed`] (1).
const SPEED: [f64; 2] = [0.01, 1000.0];

/// A message of the page that is no [`Request`].
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
enum Control {
    Shown,
    Play { on: bool, speed: f64 },
    Step,
}

/// What a page's writer has to send next.
pub enum Next {
    /// A text.
    Text(String),
    /// A frame.
    Frame(Vec<u8>),
}

struct Shared {
    /// Number of the open page, 0 if none is open, and of the last one.
    viewer: u64,
    viewers: u64,
    /// Since when none has been open.
    left: Instant,
    /// Frames that the page may still be sent.
    credit: u32,
    frame: Option<Vec<u8>>,
    texts: VecDeque<String>,
    replay: Option<Arc<str>>,
}

/// Shared by the session, the server and the page's reader and writer.
#[derive(Clone)]
pub struct Hub {
    shared: Arc<(Mutex<Shared>, Condvar)>,
    events: Sender<Event>,
}

impl Hub {
    pub fn new(events: Sender<Event>) -> Self {
        let shared = Shared {
            viewer: 0,
            viewers: 0,
            left: Instant::now(),
            credit: 0,
            frame: None,
            texts: VecDeque::new(),
            replay: None,
        };
        Hub { shared: Arc::new((Mutex::new(shared), Condvar::new())), events }
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn send(&self, event: Event) {
        // If the session has ended, so has the program.
        let _ = self.events.send(event);
    }

    /// Registers a page and returns its number. The page that was open before is sent nothing more.
    pub fn enter(&self) -> u64 {
        let mut shared = self.lock();
        shared.viewers += 1;
        shared.viewer = shared.viewers;
        (shared.credit, shared.frame) = (IN_FLIGHT, None);
        shared.texts.clear();
        let number = shared.viewer;
        drop(shared);
        self.shared.1.notify_all();
        self.send(Event::Opened);
        number
    }

    /// A page was closed.
    pub fn leave(&self, number: u64) {
        let mut shared = self.lock();
        if shared.viewer == number {
            (shared.viewer, shared.left) = (0, Instant::now());
        }
        drop(shared);
        self.shared.1.notify_all();
    }

    /// Whether a page is open.
    pub fn is_watched(&self) -> bool {
        self.lock().viewer != 0
    }

    /// Whether no page has been open for this long.
    pub fn is_left_for(&self, time: Duration) -> bool {
        let shared = self.lock();
        shared.viewer == 0 && shared.left.elapsed() >= time
    }

    /// Whether the page is ready for a frame.
    pub fn is_ready(&self) -> bool {
        let shared = self.lock();
        shared.viewer != 0 && shared.credit > 0 && shared.frame.is_none()
    }

    /// Sends a frame.
    pub fn show(&self, frame: Vec<u8>) {
        self.lock().frame = Some(frame);
        self.shared.1.notify_all();
    }

    /// Sends a text. Texts arrive before frames that are shown later.
    pub fn tell(&self, text: String) {
        self.lock().texts.push_back(text);
        self.shared.1.notify_all();
    }

    /// Keeps the page of a recording for the server.
    pub fn keep_replay(&self, page: Option<&str>) {
        self.lock().replay = page.map(Arc::from);
        self.tell(r#"{"replay":true}"#.into());
    }

    /// The page of the last recording.
    pub fn replay(&self) -> Option<Arc<str>> {
        self.lock().replay.clone()
    }

    /// Waits for what a page has to be sent next; `None` once another page is open, or none.
    pub fn next(&self, number: u64) -> Option<Next> {
        let mut shared = self.lock();
        loop {
            if shared.viewer != number {
                return None;
            }
            if let Some(text) = shared.texts.pop_front() {
                return Some(Next::Text(text));
            }
            if let Some(frame) = shared.frame.take() {
                shared.credit = shared.credit.saturating_sub(1);
                return Some(Next::Frame(frame));
            }
            shared = self.shared.1.wait(shared).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A message of a page. Errors: it is none that a page sends.
    pub fn receive(&self, number: u64, text: &str) -> Result<(), serde_json::Error> {
        let event = match serde_json::from_str::<Control>(text) {
            Ok(Control::Shown) => {
                let mut shared = self.lock();
                if shared.viewer == number {
                    shared.credit = (shared.credit + 1).min(IN_FLIGHT);
                }
                Event::Ready
            }
            Ok(Control::Play { on, speed }) => {
                let speed = speed.clamp(SPEED[0], SPEED[1]);
                Event::Play(Playback { on, speed, is_opened: false })
            }
            Ok(Control::Step) => Event::Step,
            Err(_) => Event::Session(serde_json::from_str(text)?),
        };
        self.send(event);
        Ok(())
    }
}
