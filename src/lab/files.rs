//! Result files: all or nothing.
//!
//! A file is written under a temporary name in its own folder and renamed when it is whole,
//! so that an interrupted run leaves no half file.

use crate::lab::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file that does not exist under its name until [`Pending::commit`].
pub struct Pending {
    file: std::io::BufWriter<NamedTempFile>,
    path: PathBuf,
}

impl Pending {
    /// Begins the file `path`, in a folder that exists.
    pub fn new(path: &Path) -> Result<Self, Error> {
        if path.is_dir() {
            let source = std::io::Error::from(std::io::ErrorKind::IsADirectory);
            return Err(Error::Io { path: path.into(), source });
        }
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let file = temporary(folder).map_err(Error::io(path))?;
        Ok(Pending { file: std::io::BufWriter::new(file), path: path.into() })
    }

    /// Gives the file its name.
    pub fn commit(self) -> Result<(), Error> {
        let Pending { file, path } = self;
        let file = file.into_inner().map_err(|e| Error::io(&path)(e.into_error()))?;
        file.persist(&path).map_err(|e| Error::io(&path)(e.error))?;
        Ok(())
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// A temporary file that others may read once it has its name, as the user's mask allows.
fn temporary(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".simpulse-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Makes the folder if need be, and makes sure that a file can be written there.
pub fn prepare_folder(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    temporary(folder).map_err(Error::io(folder))?;
    Ok(())
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
    fn a_folder_that_is_a_file_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        write(&path, b"").unwrap();
        assert!(prepare_folder(&path).unwrap_err().to_string().contains("taken"));
        assert!(Pending::new(folder.path()).is_err());
    }
}
