//! Reads image files by content, and writes files so that a reader never sees half a file.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::openexr::{self, ExrError};
use crate::png::{self, PngError};
use crate::{LayerError, LayerSet};

/// Temporary names tried before giving up: killed processes may have left this many files in a folder.
const MAX_TEMPORARY_FILES: u32 = 1000;

/// Why an image file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file cannot be opened or read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file cannot be written; no partial file is left.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file is neither a PNG nor an EXR.
    #[error(
        "{} is neither a PNG nor an EXR: it {}, a PNG starts with {}, an EXR with {}",
        path.display(), started(start), hex(png::SIGNATURE), hex(openexr::SIGNATURE)
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Its first bytes: as many as a signature has, or the whole file if it is shorter.
        start: Vec<u8>,
    },
    /// The PNG is damaged.
    #[error("cannot read {}", path.display())]
    Png {
        /// The file.
        path: PathBuf,
        /// The decoder's reason.
        source: PngError,
    },
    /// The EXR is damaged.
    #[error("cannot read {}", path.display())]
    Exr {
        /// The file.
        path: PathBuf,
        /// The decoder's reason.
        source: ExrError,
    },
    /// The contents of the file do not form a set of layers.
    #[error("cannot read {}", path.display())]
    Layers {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: LayerError,
    },
}

/// Most bytes of an EXR's header that are read to measure it.
const MOST_HEADER_BYTES: u64 = 16 << 20;

/// The meaning of a picture's numbers, which follows from the format of its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Display values, at most 1 after decoding: a PNG.
    Display,
    /// Linear light, or the quantity that a layer's name states, without a limit: an EXR.
    Linear,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Display => "a PNG, which holds display values",
            Self::Linear => "an EXR, which holds linear values",
        })
    }
}

/// Contents of an image file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Meaning of the numbers. It does not follow from the layers: an EXR may have the only layer of a PNG.
    pub kind: Kind,
    /// The layers. A PNG has one, [`png::DECODED_NAME`].
    pub layers: LayerSet,
}

/// The size of a picture in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measure {
    /// Length of the file, bytes.
    pub file_bytes: u64,
    /// Pixels of the largest layer.
    pub pixels: u64,
    /// Samples of all channels of all layers, which take four bytes each once they are read.
    pub samples: u64,
}

/// Reads the header of a PNG or an EXR: what reading the rest would take.
///
/// # Errors
/// If the file cannot be read, is neither a PNG nor an EXR, or its header is damaged.
pub fn measure(path: &Path) -> Result<Measure, FileError> {
    let cannot_read = |source| FileError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(cannot_read)?;
    let file_bytes = file.metadata().map_err(cannot_read)?.len();
    let mut start = Vec::new();
    (&file).take(png::HEADER_BYTES as u64).read_to_end(&mut start).map_err(cannot_read)?;
    let (pixels, samples) = if start.starts_with(png::SIGNATURE) {
        let pixels = png::declared_pixels(&start);
        (pixels, 4 * pixels)
    } else if start.starts_with(openexr::SIGNATURE) {
        // Headers with more than some megabytes are not those of pictures.
        let header = start.as_slice().chain((&file).take(MOST_HEADER_BYTES));
        openexr::measure(io::BufReader::new(header)).map_err(|source| FileError::Exr { path: path.to_owned(), source })?
    } else {
        return Err(FileError::UnknownFormat { path: path.to_owned(), start: start[..start.len().min(png::SIGNATURE.len())].to_vec() });
    };
    Ok(Measure { file_bytes, pixels, samples })
}

/// Reads a PNG or an EXR. The first bytes of the file decide which, not its name. A file that starts with other bytes is not read further.
///
/// # Errors
/// If the file cannot be read, is neither a PNG nor an EXR, or is damaged.
pub fn read(path: &Path) -> Result<Picture, FileError> {
    let cannot_read = |source| FileError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(cannot_read)?;
    let mut bytes = Vec::new();
    (&file).take(png::SIGNATURE.len() as u64).read_to_end(&mut bytes).map_err(cannot_read)?;
    let kind = if bytes.starts_with(png::SIGNATURE) {
        Kind::Display
    } else if bytes.starts_with(openexr::SIGNATURE) {
        Kind::Linear
    } else {
        return Err(FileError::UnknownFormat { path: path.to_owned(), start: bytes });
    };
    // No more than the file had: a device has no end.
    let rest = file.metadata().map_err(cannot_read)?.len().saturating_sub(bytes.len() as u64);
    file.take(rest).read_to_end(&mut bytes).map_err(cannot_read)?;
    let layers = match kind {
        Kind::Display => {
            let layer = png::decode(&bytes).map_err(|source| FileError::Png { path: path.to_owned(), source })?;
            let mut layers = LayerSet::new();
            layers.push(layer).map_err(|source| FileError::Layers { path: path.to_owned(), source })?;
            layers
        }
        Kind::Linear => openexr::decode(&bytes).map_err(|source| FileError::Exr { path: path.to_owned(), source })?,
    };
    Ok(Picture { kind, layers })
}

/// Bytes as two hexadecimal digits each, for a message.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

/// The first bytes of a file, for a message.
fn started(start: &[u8]) -> String {
    if start.is_empty() { "is empty".to_owned() } else { format!("starts with {} (\"{}\")", hex(start), start.escape_ascii()) }
}

/// Writes a whole file, or leaves the old one unchanged.
///
/// The bytes go to a new file in the same folder (`.nephroid-N.partial`), reach the disk, and only then take the name `path`, in one step that
/// replaces an older file.
///
/// # Errors
/// If the file cannot be written. The temporary file has then been removed.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let write = || -> io::Result<()> {
        let (temporary_path, mut file) = create_beside(path)?;
        let written = file.write_all(bytes).and_then(|()| file.sync_all());
        drop(file);
        let renamed = written.and_then(|()| fs::rename(&temporary_path, path));
        if renamed.is_err() {
            // The first error is reported; failing to remove the temporary file, too, adds nothing.
            let _ = fs::remove_file(&temporary_path);
        }
        renamed
    };
    write().map_err(|source| FileError::Write { path: path.to_owned(), source })
}

/// Checks whether [`write_atomically`] could write here, without touching `path`: useful before an hour of work.
///
/// # Errors
/// If no file can be created in the folder, or `path` is a folder.
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    let check = || -> io::Result<()> {
        if path.is_dir() {
            return Err(io::Error::from(io::ErrorKind::IsADirectory));
        }
        let (temporary_path, file) = create_beside(path)?;
        drop(file);
        fs::remove_file(temporary_path)
    };
    check().map_err(|source| FileError::Write { path: path.to_owned(), source })
}

/// Creates a new file in the folder of `path`, under an unused name.
fn create_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    let mut number = 0;
    loop {
        // The name has a fixed length: a long file name must not become too long.
        let temporary_path = path.with_file_name(format!(".nephroid-{number}.partial"));
        match OpenOptions::new().write(true).create_new(true).open(&temporary_path) {
            Ok(file) => return Ok((temporary_path, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number + 1 < MAX_TEMPORARY_FILES => number += 1,
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Layer, ToneMap};

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn writing_replaces_the_file_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_atomically(&path, b"one").unwrap();
        write_atomically(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn failing_to_rename_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::create_dir(&path).unwrap();
        fs::write(path.join("inside"), b"x").unwrap();
        let error = write_atomically(&path, b"bytes").unwrap_err();
        assert!(matches!(error, FileError::Write { path: named, .. } if named == path));
        assert_eq!(names(folder.path()), ["taken"]);
        assert!(check_writable(&path).is_err());
    }

    #[test]
    fn a_missing_folder_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such/a.exr");
        for error in [write_atomically(&path, b"").unwrap_err(), check_writable(&path).unwrap_err()] {
            assert_eq!(error.to_string(), format!("cannot write {}", path.display()));
        }
        assert_eq!(names(folder.path()), Vec::<String>::new());
    }

    #[test]
    fn leftovers_of_killed_processes_are_stepped_over() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(".nephroid-0.partial"), b"half").unwrap();
        let path = folder.path().join("x".repeat(255));
        write_atomically(&path, b"whole").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(fs::read(folder.path().join(".nephroid-0.partial")).unwrap(), b"half");
    }

    #[test]
    fn asking_leaves_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        check_writable(&path).unwrap();
        assert_eq!(names(folder.path()), Vec::<String>::new());
    }

    /// An image with one layer, as a PNG and as an EXR.
    fn one_layer() -> (LayerSet, Vec<u8>, Vec<u8>) {
        let layer = Layer::from_pixels(png::DECODED_NAME, 1, 1, &[[0.0, 1.0, 1.0]]).unwrap();
        let mut layers = LayerSet::new();
        layers.push(layer.clone()).unwrap();
        let png = png::encode(&layer, &ToneMap { white: 1.0, ..ToneMap::default() }).unwrap();
        let exr = openexr::encode(&layers).unwrap();
        (layers, png, exr)
    }

    #[test]
    fn the_content_decides_how_a_file_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let (layers, png, exr) = one_layer();
        for name in ["picture", "picture.png", "picture.exr"] {
            let path = folder.path().join(name);
            write_atomically(&path, &png).unwrap();
            assert_eq!(read(&path).unwrap(), Picture { kind: Kind::Display, layers: layers.clone() }, "{name}");
            write_atomically(&path, &exr).unwrap();
            assert_eq!(read(&path).unwrap(), Picture { kind: Kind::Linear, layers: layers.clone() }, "{name}");
        }
        assert!(matches!(read(&folder.path().join("absent")), Err(FileError::Read { .. })));
    }

    #[test]
    fn other_signatures_are_told_with_those_allowed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let allowed = ", a PNG starts with 89 50 4e 47 0d 0a 1a 0a, an EXR with 76 2f 31 01";
        for (bytes, seen) in [
            (&b"GIF89a\x01\x00\x01\x00"[..], "starts with 47 49 46 38 39 61 01 00 (\"GIF89a\\x01\\x00\")"),
            // A PNG that a transfer as text has damaged: what the signature is made to show.
            (&b"\x89PNG\n\x1a\n\0\0"[..], "starts with 89 50 4e 47 0a 1a 0a 00 (\"\\x89PNG\\n\\x1a\\n\\x00\")"),
            (&b"\x76\x2f\x31"[..], "starts with 76 2f 31 (\"v/1\")"),
            (&b""[..], "is empty"),
        ] {
            write_atomically(&path, bytes).unwrap();
            let error = read(&path).unwrap_err();
            assert_eq!(error.to_string(), format!("{} is neither a PNG nor an EXR: it {seen}{allowed}", path.display()));
        }
    }
}
