//! The fuzzing loop: mutate, judge, keep new behavior, report failures.

use rand::{RngExt, SeedableRng};
use std::backtrace::Backtrace;
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::{Seek, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Once};
use std::time::{Duration, Instant};

pub type Random = rand_pcg::Pcg64Mcg;

/// Longer inputs are truncated.
const MOST_BYTES: usize = 1 << 18;
/// Longer inputs are tried, but do not become parents.
const MOST_BYTES_KEPT: usize = 12_000;
/// Inputs that take longer are saved for inspection.
const SLOW: Duration = Duration::from_secs(10);
/// Time limit of one input in a long run.
const LONGEST: Duration = Duration::from_secs(60);
/// Memory limit of the process in a long run (KiB).
const MOST_MEMORY_KIB: u64 = 3 << 20;
/// Largest number of trials when shortening a failing input.
const MOST_CUTS: usize = 3000;

/// A fuzz target.
pub struct Target {
    pub name: &'static str,
    /// Initial parents.
    pub seeds: Vec<Vec<u8>>,
    /// Makes a child of one or two parents.
    pub mutate: fn(&mut Random, &[Vec<u8>]) -> Vec<u8>,
    /// Returns the behavior, in words that are equal for similar inputs, or the failure. The number selects
    /// everything that the input leaves open.
    pub judge: fn(&[u8], u64) -> Result<String, String>,
}

/// Tries `inputs` inputs. With `SIMPULSE_FUZZ_SECONDS`, tries as many as fit into that much processor time of
/// the thread. Panics with the failures found.
pub fn run(target: &Target, inputs: u64) {
    quiet_panics();
    if let Ok(path) = std::env::var("SIMPULSE_FUZZ_INPUT") {
        let input = std::fs::read(path).expect("the input can be read");
        let salts = std::env::var("SIMPULSE_FUZZ_SALT").map_or(0..1000, |s| {
            let s = s.parse().expect("a whole number");
            s..s + 1
        });
        for salt in salts {
            println!("{}: salt {salt}: {:?}", target.name, judge(target, &input, salt));
        }
        return;
    }
    let number = |name| std::env::var(name).ok().map(|text| text.parse::<u64>().expect("a whole number"));
    let seconds = number("SIMPULSE_FUZZ_SECONDS").map(Duration::from_secs);
    let seed = number("SIMPULSE_FUZZ_SEED").unwrap_or(1);
    let mut random = Random::seed_from_u64(seed);
    let watch = seconds.map(|_| HoldWatch::start(target.name));

    // Rejected inputs lead to other rejections and seldom to a scene, so they have their own list of parents.
    let (mut accepting, mut refusing) = (target.seeds.clone(), target.seeds.clone());
    let mut seen = HashSet::new();
    let mut accepted = 0;
    let mut found = BTreeMap::new();
    let clock = Clock::of_this_thread();
    let (start, mut reported, mut slowest) = (clock.read(), Duration::ZERO, Duration::ZERO);
    let mut count = 0;
    let summary = |count, accepted, kinds, slowest: Duration| {
        let (name, time) = (target.name, clock.read() - start);
        format!(
            "{name}: {time:.0?}, {count} inputs, {accepted} accepted, {kinds} kinds of behavior, slowest {slowest:.1?}"
        )
    };
    while seconds.map_or(count < inputs, |s| clock.read() - start < s) {
        let salt: u64 = random.random();
        let mut input = match target.seeds.get(count as usize) {
            Some(seed) => seed.clone(),
            None if random.random_ratio(3, 4) => (target.mutate)(&mut random, &accepting),
            None => (target.mutate)(&mut random, &refusing),
        };
        input.truncate(MOST_BYTES);
        if let Some(watch) = &watch {
            watch.begin(&input, salt);
        }
        let verdict = judge(target, &input, salt);
        let took = watch.as_ref().map_or(Duration::ZERO, HoldWatch::end);
        slowest = slowest.max(took);
        if took > SLOW {
            let path = folder().join(format!("fuzz-{}-{seed}-{count}-slow.input", target.name));
            std::fs::write(&path, &input).expect("the target folder can be written");
            eprintln!("{}: {took:.0?} for salt {salt} and {}", target.name, path.display());
        }
        match verdict {
            Ok(behavior) => {
                let good = behavior.starts_with("accepted");
                accepted += u64::from(good);
                if seen.insert(behavior) && input.len() <= MOST_BYTES_KEPT {
                    if good { accepting.push(input) } else { refusing.push(input) }
                }
            }
            Err(what) => {
                let kind = kind(&what);
                found.entry(kind).or_insert_with(|| {
                    let input = shorten(target, input, salt, &what);
                    let path = folder().join(format!("fuzz-{}-{seed}-{count}.input", target.name));
                    std::fs::write(&path, &input).expect("the target folder can be written");
                    let text = String::from_utf8_lossy(&input[..input.len().min(400)]).into_owned();
                    let report = format!(
                        "{}: {what}\n  seed {seed}, input {count}, salt {salt}: {}\n  {text:?}",
                        target.name,
                        path.display()
                    );
                    eprintln!("{report}");
                    report
                });
            }
        }
        count += 1;
        if seconds.is_some() && clock.read() - start - reported > Duration::from_secs(60) {
            reported = clock.read() - start;
            eprintln!("{}", summary(count, accepted, seen.len(), slowest));
        }
    }
    drop(watch);
    println!("{}", summary(count, accepted, seen.len(), slowest));
    let reports: Vec<String> = found.into_values().collect();
    assert!(reports.is_empty(), "{}", reports.join("\n"));
}

/// Judges an input. A panic counts as a failure.
fn judge(target: &Target, input: &[u8], salt: u64) -> Result<String, String> {
    QUIET.set(true);
    let verdict = catch_unwind(AssertUnwindSafe(|| (target.judge)(input, salt)));
    QUIET.set(false);
    verdict.unwrap_or_else(|_| Err(format!("panic: {}", LAST_PANIC.take())))
}

/// Key that reports each failure once: panics by their location, others by their first words.
fn kind(what: &str) -> String {
    what.split(": ").take(2).collect::<Vec<_>>().join(": ")
}

/// Removes all parts of the input that are not needed for the same failure.
fn shorten(target: &Target, mut input: Vec<u8>, salt: u64, what: &str) -> Vec<u8> {
    let mut tries = 0;
    let mut size = input.len() / 2;
    while size > 0 {
        let mut at = 0;
        while at < input.len() && tries < MOST_CUTS {
            let mut shorter = input.clone();
            shorter.drain(at..(at + size).min(input.len()));
            tries += 1;
            match judge(target, &shorter, salt) {
                Err(other) if kind(&other) == kind(what) => input = shorter,
                _ => at += size,
            }
        }
        size /= 2;
    }
    input
}

fn folder() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
    static LAST_PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Stores panics of judged inputs instead of printing them.
fn quiet_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if QUIET.get() {
                let place = info.location().map_or(String::new(), |l| format!("{}:{}", l.file(), l.line()));
                let payload = info.payload();
                let message = payload.downcast_ref::<&str>().copied();
                let message = message.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
                let trace = Backtrace::force_capture().to_string();
                let ours = trace.lines().filter(|l| l.contains("simpulse::")).take(4).map(str::trim);
                let callers = ours.collect::<Vec<_>>().join(" < ");
                LAST_PANIC.set(format!("{place}: {}, in {callers}", message.unwrap_or("no message")));
            } else {
                usual(info);
            }
        }));
    });
}

/// A second thread that ends the process if an input takes too much time or memory. The input is written to a
/// file before it is tried, so it survives an abort.
struct HoldWatch {
    path: PathBuf,
    file: Mutex<File>,
    begun: Arc<Mutex<Option<Duration>>>,
    clock: Clock,
    stop: Arc<AtomicBool>,
}

impl HoldWatch {
    fn start(name: &'static str) -> Self {
        let path = folder().join(format!("fuzz-{name}-current.input"));
        let file = Mutex::new(File::create(&path).expect("the target folder can be written"));
        let (begun, stop) = (Arc::new(Mutex::new(None::<Duration>)), Arc::new(AtomicBool::new(false)));
        let clock = Clock::of_this_thread();
        let watched = clock.clone();
        let (place, shared, done) = (path.clone(), begun.clone(), stop.clone());
        std::thread::spawn(move || {
            while !done.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(50));
                let time = shared
                    .lock()
                    .unwrap()
                    .map_or(Duration::ZERO, |begun| watched.read().saturating_sub(begun));
                let memory = memory_kib();
                if time > LONGEST || memory > MOST_MEMORY_KIB {
                    eprintln!("{name}: {time:.1?} and {memory} KiB for {}", place.display());
                    std::process::exit(1);
                }
            }
        });
        HoldWatch { path, file, begun, clock, stop }
    }

    fn begin(&self, input: &[u8], salt: u64) {
        let mut file = self.file.lock().unwrap();
        let salt = format!("\n{salt}");
        let length = (input.len() + salt.len()) as u64;
        let written = file
            .rewind()
            .and_then(|_| file.write_all(input))
            .and_then(|_| file.write_all(salt.as_bytes()))
            .and_then(|_| file.set_len(length));
        written.expect("the target folder can be written");
        *self.begun.lock().unwrap() = Some(self.clock.read());
    }

    /// Returns how long the input took.
    fn end(&self) -> Duration {
        let begun = self.begun.lock().unwrap().take();
        begun.map_or(Duration::ZERO, |begun| self.clock.read().saturating_sub(begun))
    }
}

impl Drop for HoldWatch {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Run time of one thread, so that a busy machine does not look like a slow input. Elapsed time if the system
/// does not provide the run time.
#[derive(Clone)]
struct Clock {
    path: PathBuf,
    start: Instant,
}

impl Clock {
    fn of_this_thread() -> Self {
        let thread = std::fs::read_link("/proc/thread-self").unwrap_or_default();
        Clock { path: Path::new("/proc").join(thread).join("schedstat"), start: Instant::now() }
    }

    fn read(&self) -> Duration {
        let text = std::fs::read_to_string(&self.path).unwrap_or_default();
        let run = text.split_whitespace().next().and_then(|ns| ns.parse().ok());
        run.map_or_else(|| self.start.elapsed(), Duration::from_nanos)
    }
}

/// Memory held by the process; 0 if the system does not provide it.
fn memory_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().strip_suffix(" kB")?.parse().ok()).unwrap_or(0)
}
