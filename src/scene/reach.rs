//! Which files a file may name: those near it, and nothing else.
//!
//! Scenes and meshes come from other people, and must not make the program read what its user did not mean to hand over. A name in a file
//! is a relative path with `/` between its parts. It is checked twice before anything is opened: as it is written, without a look
//! at the disk ([`Reach::check`]); then where it leads once all links are followed ([`Reach::locate`]).

use std::io;
use std::path::{Path, PathBuf};

/// How far the names in a file reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reach {
    /// The folder of the naming file and everything below it, such as the buffers of a glTF.
    Below,
    /// Also everything below a sibling of that folder: a scene in `scenes` may name `../meshes/a.ply`.
    Beside,
}

/// Why a name is not followed.
#[derive(Debug)]
pub(crate) enum Astray {
    /// What is wrong with it, as "which ...".
    Refused(&'static str),
    /// The file does not exist, or the file system refuses to look.
    Io(io::Error),
}

/// The message for a name that leads elsewhere.
const LEAVES: &str = "which leads out of reach";

/// The message for a link that leads elsewhere.
const LINK_LEAVES: &str = "which a link leads out of reach";

/// Refuses a name that does not mean the same on every machine: only a relative path with `/` between its parts does.
pub(crate) fn check_portable(name: &str) -> Result<(), &'static str> {
    for (character, why) in
        [('\0', "which holds a NUL"), ('\\', "which holds a backslash"), (':', "which holds a colon, as of a scheme or a drive")]
    {
        if name.contains(character) {
            return Err(why);
        }
    }
    if name.starts_with('/') { Err("which is absolute") } else { Ok(()) }
}

impl Reach {
    /// Refuses a name that is not portable, or that its own `..` lead out of reach.
    pub(crate) fn check(self, name: &str) -> Result<(), &'static str> {
        check_portable(name)?;
        let lowest = match self {
            Self::Below => 0,
            Self::Beside => -1,
        };
        // How many folders below the naming file's own.
        let mut depth = 0;
        for part in name.split('/') {
            match part {
                "" | "." => {}
                ".." => depth -= 1,
                _ => depth += 1,
            }
            if depth < lowest {
                return Err(LEAVES);
            }
        }
        match depth {
            1.. => Ok(()),
            // A file directly in the parent folder is neither below this folder nor below one of its siblings.
            _ if name.split('/').next_back().is_some_and(|last| !["", ".", ".."].contains(&last)) => Err(LEAVES),
            _ => Err("which names no file"),
        }
    }

    /// Where a name in a file of `folder` leads, all links followed. Opens nothing.
    pub(crate) fn locate(self, folder: &Path, name: &str) -> Result<PathBuf, Astray> {
        self.check(name).map_err(Astray::Refused)?;
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let own = folder.canonicalize().map_err(Astray::Io)?;
        let target = own.join(name).canonicalize().map_err(Astray::Io)?;
        let below = target.starts_with(&own);
        let beside = || own.parent().is_some_and(|above| target.strip_prefix(above).is_ok_and(|rest| rest.components().count() > 1));
        if below || self == Self::Beside && beside() { Ok(target) } else { Err(Astray::Refused(LINK_LEAVES)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_reach_as_far_as_their_parts_say() {
        for (name, below, beside) in [
            ("a.bin", true, true),
            ("./a.bin", true, true),
            ("sub/a.bin", true, true),
            ("sub//./b/../a.bin", true, true),
            ("sub/../a.bin", true, true),
            ("..a.bin", true, true),
            (".../a.bin", true, true),
            ("../meshes/a.ply", false, true),
            ("sub/../../meshes/a.ply", false, true),
            ("../meshes/deep/../a.ply", false, true),
            ("../a.ply", false, false),
            ("sub/../../a.ply", false, false),
            ("../meshes/../a.ply", false, false),
            ("../../meshes/a.ply", false, false),
            ("../meshes/../../a.ply", false, false),
            ("a/../../../b/c/a.ply", false, false),
            ("/a.bin", false, false),
            ("//host/a.bin", false, false),
            ("..\\a.bin", false, false),
            ("sub\\..\\a.bin", false, false),
            ("C:a.bin", false, false),
            ("file:///a.bin", false, false),
            ("a.bin\0", false, false),
            ("", false, false),
            (".", false, false),
            ("sub/..", false, false),
            ("..", false, false),
            ("../", false, false),
        ] {
            assert_eq!(Reach::Below.check(name).is_ok(), below, "{name:?} below");
            assert_eq!(Reach::Beside.check(name).is_ok(), beside, "{name:?} beside");
        }
    }

    #[test]
    fn places_are_found_in_the_current_folder_and_told_if_there_is_nothing() {
        // Tests of a crate run in its folder.
        let found = Reach::Below.locate(Path::new(""), "Cargo.toml").expect("the file exists");
        assert_eq!(found, Path::new("Cargo.toml").canonicalize().unwrap());
        assert!(matches!(Reach::Below.locate(Path::new(""), "absent"), Err(Astray::Io(_))));
        assert!(matches!(Reach::Below.locate(Path::new("absent"), "Cargo.toml"), Err(Astray::Io(_))));
    }
}
