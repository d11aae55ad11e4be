//! Result files, written completely or not at all.
//!
//! A regular file is written under a temporary name in its own folder and renamed when it is complete, so an
//! interrupted run leaves no partial file. Of a link to a file, the file is replaced. Devices, pipes and
//! `/dev/stdout` are written directly; `-` is standard output.
//!
//! Temporary names are kept in a list until they are gone, so that a signal can remove them
//! ([`remove_temporaries`]).

use crate::lab::error::Error;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

static TEMPORARIES: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Folders created for files that do not exist yet.
static MADE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file that appears under its name only with [`Pending::commit`].
pub struct Pending {
    writer: BufWriter<Box<dyn Write>>,
    /// A temporary file, and the path to which it is renamed when complete; `None` for what is written
    /// directly.
    temporary: Option<(Temporary, PathBuf)>,
    path: PathBuf,
}

impl Pending {
    /// Starts the file `path`, in an existing folder.
    pub fn new(path: &Path) -> Result<Self, Error> {
        let (writer, temporary) = target(path).map_err(Error::io(path))?;
        Ok(Pending { writer: BufWriter::new(writer), temporary, path: path.into() })
    }

    /// Completes the file and gives it its name.
    pub fn commit(self) -> Result<(), Error> {
        let Pending { mut writer, temporary, path } = self;
        writer.flush().map_err(Error::io(&path))?;
        drop(writer);
        match temporary {
            Some((temporary, place)) => temporary.persist(&place).map_err(Error::io(&path)),
            None => Ok(()),
        }
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.flush()
    }
}

/// Where the bytes of a file go: a writer, and the temporary file if there is one, with its final path.
type FileTarget = (Box<dyn Write>, Option<(Temporary, PathBuf)>);

fn target(path: &Path) -> std::io::Result<FileTarget> {
    if is_standard_output(path) {
        return Ok((Box::new(std::io::stdout()), None));
    }
    let place = path.canonicalize().unwrap_or_else(|_| path.into());
    match std::fs::metadata(&place) {
        Ok(found) if found.is_dir() => Err(ErrorKind::IsADirectory.into()),
        // Devices and pipes are written directly.
        Ok(found) if !found.is_file() => Ok((Box::new(OpenOptions::new().append(true).open(&place)?), None)),
        Ok(found) if found.permissions().readonly() => Err(ErrorKind::PermissionDenied.into()),
        _ => {
            let temporary = Temporary::in_folder(folder_of(&place))?;
            Ok((Box::new(temporary.0.reopen()?), Some((temporary, place))))
        }
    }
}

/// Whether `path` is standard output. If so, nothing else may be printed there.
pub fn is_standard_output(path: &Path) -> bool {
    ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|name| path == Path::new(name))
}

/// Whether two paths refer to the same file.
pub fn same_file(a: &Path, b: &Path) -> bool {
    // Of a file that does not exist, its folder does.
    let place = |path: &Path| {
        let folder = || {
            Ok::<_, std::io::Error>(
                folder_of(path).canonicalize()?.join(path.file_name().unwrap_or_default()),
            )
        };
        path.canonicalize().or_else(|_| folder()).unwrap_or_else(|_| path.into())
    };
    (is_standard_output(a) && is_standard_output(b)) || place(a) == place(b)
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A file under a temporary name, which is in the list as long as the file exists.
struct Temporary(NamedTempFile);

impl Temporary {
    /// A new temporary file. Its permissions follow the user's mask, so that others can read the final file.
    fn in_folder(folder: &Path) -> std::io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".simpulse-");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        // Locked before the file exists, so that a signal finds it in the list or not at all.
        let mut list = locked(&TEMPORARIES);
        // The original message contains the temporary name, which means nothing to the user.
        let file = builder.tempfile_in(folder).map_err(plain)?;
        list.push(file.path().to_path_buf());
        Ok(Temporary(file))
    }

    fn persist(self, place: &Path) -> std::io::Result<()> {
        let name = self.0.path().to_path_buf();
        self.0.persist(place).map_err(|e| plain(e.error))?;
        locked(&TEMPORARIES).retain(|other| *other != name);
        Ok(())
    }
}

/// A system error without the path that `tempfile` adds.
fn plain(error: std::io::Error) -> std::io::Error {
    match error.get_ref().and_then(|inner| std::error::Error::source(inner)) {
        Some(source) => match source.downcast_ref::<std::io::Error>().and_then(|e| e.raw_os_error()) {
            Some(code) => std::io::Error::from_raw_os_error(code),
            None => error.kind().into(),
        },
        None => error,
    }
}

fn locked<T>(list: &'static Mutex<T>) -> MutexGuard<'static, T> {
    list.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes incomplete files before the process exits. No other file can be started afterwards.
pub fn remove_temporaries() {
    let list = locked(&TEMPORARIES);
    for path in list.iter() {
        let _ = std::fs::remove_file(path);
    }
    // Only empty folders can be removed.
    for folder in locked(&MADE).iter() {
        let _ = std::fs::remove_dir(folder);
    }
    std::mem::forget(list);
}

/// Creates the folder if necessary, and checks that a file can be written there. If the folder is new and
/// still empty, [`remove_temporaries`] removes it again.
pub fn prepare_folder(folder: &Path) -> Result<(), Error> {
    let missing: Vec<PathBuf> = folder
        .ancestors()
        .take_while(|f| !f.as_os_str().is_empty() && !f.exists())
        .map(PathBuf::from)
        .collect();
    // Innermost first, the order in which they can be removed.
    locked(&MADE).extend(missing);
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    Temporary::in_folder(folder).map_err(Error::io(folder))?;
    Ok(())
}

/// Name of the file that marks a folder as in use.
const LOCK: &str = ".simpulse.lock";

/// Exclusive use of a folder of results, until it is dropped or the process ends.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// The system releases this lock when the process ends, for whatever reason.
    file: Option<File>,
}

impl Lock {
    /// Locks a folder. Errors: the folder is locked by another process, or cannot be written.
    pub fn of(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(LOCK);
        let file = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
        let file = file.map_err(Error::io(folder))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => {
                let message = "another study is writing there; give another folder with --out";
                return Err(Error::invalid(folder.display().to_string(), message));
            }
            // On a system without file locks, users must keep two studies apart themselves.
            Err(std::fs::TryLockError::Error(_)) => {}
        }
        locked(&TEMPORARIES).push(path.clone());
        Ok(Lock { path, file: Some(file) })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
        drop(self.file.take());
        locked(&TEMPORARIES).retain(|name| *name != self.path);
    }
}

/// Writes a whole file.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = Pending::new(path)?;
    file.write_all(bytes).map_err(Error::io(path))?;
    file.commit()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_there_when_it_is_whole_and_not_before() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("a/b");
        prepare_folder(&inner).unwrap();
        let path = inner.join("x.csv");
        let mut pending = Pending::new(&path).unwrap();
        pending.write_all(b"half").unwrap();
        assert!(!path.exists());
        drop(pending);
        assert_eq!(std::fs::read_dir(&inner).unwrap().count(), 0);
        write(&path, b"whole").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
    }

    #[test]
    fn a_folder_in_use_is_refused_by_name_and_free_afterward() {
        let folder = tempfile::tempdir().unwrap();
        let first = Lock::of(folder.path()).unwrap();
        let message = Lock::of(folder.path()).unwrap_err().to_string();
        assert!(message.contains("another study") && !message.contains(LOCK), "{message}");
        drop(first);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        Lock::of(folder.path()).unwrap();
    }

    #[test]
    fn a_folder_that_is_a_file_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        write(&path, b"").unwrap();
        assert!(prepare_folder(&path).unwrap_err().to_string().contains("taken"));
        assert!(Pending::new(folder.path()).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_to_files_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("file.csv"), "zero").unwrap();
        std::os::unix::fs::symlink("second", at("first")).unwrap();
        std::os::unix::fs::symlink("file.csv", at("second")).unwrap();
        for text in ["one", "two"] {
            write(&at("first"), text.as_bytes()).unwrap();
            assert_eq!(std::fs::read(at("file.csv")).unwrap(), text.as_bytes());
            assert!(at("first").is_symlink() && at("second").is_symlink());
        }
        assert!(same_file(&at("first"), &at("file.csv")) && !same_file(&at("first"), &at("other")));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_is_written_through_and_stays_one() {
        use std::os::unix::fs::FileTypeExt;
        let full = Path::new("/dev/full");
        assert_eq!(write(full, b"x").unwrap_err().to_string().split(':').next(), Some("/dev/full"));
        assert!(std::fs::metadata(full).unwrap().file_type().is_char_device());
        write(Path::new("/dev/null"), b"x").unwrap();
        assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }
}
