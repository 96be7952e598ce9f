//! The keys of `--set KEY=VALUE`: one list, from which the command line, `nephroid list settings`, the docs and the tests are made.
//!
//! The keys of what every scene has stand in `table`; those of the techniques follow from their tables of rows. A key that names
//! something the scene does not have (`water.grid` of a dry scene) reads as `None` and cannot be set. Setting is all or nothing: the changed
//! scene is validated as a whole, and a refused value leaves it as it was.

mod table;
pub(crate) mod value;

use std::any::Any;
use std::borrow::Cow;

use super::check::Invalid;
use super::description::Scene;
use super::names::nearest;
use super::settings::{Row, Settings};

/// One key: what it means, and how to read and write it.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Its name, as in `--set KEY=VALUE`.
    pub key: &'static str,
    /// What it sets, in one sentence.
    pub doc: &'static str,
    /// The unit of its value; empty for pure numbers and names.
    pub unit: &'static str,
    /// The value of a scene file that does not mention it; `-` where the file must.
    pub default: Cow<'static, str>,
    /// The values allowed.
    pub allowed: Cow<'static, str>,
    place: Place,
}

/// Where the value of a key is.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// In the scene itself.
    Scene { get: fn(&Scene) -> Option<String>, set: fn(&mut Scene, &str) -> Result<(), Refusal> },
    /// Among the settings of a technique.
    Technique(&'static Row),
}

impl Setting {
    /// The key of a technique's row.
    fn of_row(defaults: &dyn Settings, row: &'static Row) -> Self {
        let value: &dyn Any = defaults;
        let text = (row.field)(value).map(|field| (field.text(), field.allowed((row.limits)()).to_string()));
        let (default, allowed) = text.unwrap_or_default();
        let (default, allowed) = (Cow::Owned(default), Cow::Owned(allowed));
        Self { key: row.key, doc: row.doc(), unit: row.unit, default, allowed, place: Place::Technique(row) }
    }

    /// The scene's value, written so that [`Setting::set`] reads it back; `None` where the scene has nothing of the kind.
    #[must_use]
    pub fn get(&self, scene: &Scene) -> Option<String> {
        match self.place {
            Place::Scene { get, .. } => get(scene),
            Place::Technique(row) => scene.techniques.field(row).map(|field| field.text()),
        }
    }

    /// Writes a value into the scene, without checking its range.
    pub fn set(&self, scene: &mut Scene, text: &str) -> Result<(), Refusal> {
        match self.place {
            Place::Scene { set, .. } => set(scene, text),
            Place::Technique(row) => {
                let field = scene.techniques.field_mut(row).ok_or(Refusal::Absent("settings of this technique"))?;
                if field.set_text(text) { Ok(()) } else { Err(Refusal::Unreadable) }
            }
        }
    }
}

/// Every key of a scene and of these techniques, in the order in which they are listed.
pub fn settings<'s>(techniques: impl IntoIterator<Item = &'s dyn Settings>) -> Vec<Setting> {
    let of_rows = techniques.into_iter().flat_map(|defaults| defaults.rows().iter().map(move |row| Setting::of_row(defaults, row)));
    table::SCENE.iter().cloned().chain(of_rows).chain(table::TRACE.iter().cloned()).collect()
}

/// Why a setter wrote nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The text is no value of the key's type.
    Unreadable,
    /// The scene has nothing that the key could change; the text says what is missing.
    Absent(&'static str),
}

/// Why a setting was refused; the scene is unchanged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// There is no such key.
    #[error("unknown setting `{key}`{}; `nephroid list settings` shows all {count}", .nearest.map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default())]
    UnknownKey {
        /// The key seen.
        key: String,
        /// The key that was perhaps meant.
        nearest: Option<&'static str>,
        /// How many keys there are.
        count: usize,
    },
    /// The value is of the wrong kind or outside of its range.
    #[error("setting `{key}`: found `{found}`, expected {allowed}")]
    Value {
        /// The key.
        key: &'static str,
        /// The value seen.
        found: String,
        /// The values allowed.
        allowed: String,
    },
    /// The value is allowed by itself, but not together with the rest of the scene.
    #[error("setting `{key}` to `{found}`: {conflict}")]
    Conflict {
        /// The key.
        key: &'static str,
        /// The value seen.
        found: String,
        /// Which value of the scene is no longer allowed.
        conflict: Invalid,
    },
    /// The scene has nothing that this key could change.
    #[error("setting `{key}`: the scene has no {missing}")]
    Absent {
        /// The key.
        key: &'static str,
        /// What is missing.
        missing: &'static str,
    },
    /// There is no `=` in `KEY=VALUE`.
    #[error("setting `{0}`: expected KEY=VALUE")]
    NoValue(String),
}

impl Scene {
    /// Every key that this scene knows, in the order in which they are listed: its own, and those of the techniques it was read for.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        settings(self.techniques.iter().map(|settings| settings.defaults()))
    }

    /// Sets `key` to `value`, both as on the command line; see [`Scene::settings`].
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SettingError> {
        let setting = find(&self.settings(), key)?;
        let refused = |refusal| match refusal {
            Refusal::Unreadable => {
                SettingError::Value { key: setting.key, found: value.to_owned(), allowed: setting.allowed.clone().into_owned() }
            }
            Refusal::Absent(missing) => SettingError::Absent { key: setting.key, missing },
        };
        let mut changed = self.clone();
        setting.set(&mut changed, value.trim()).map_err(refused)?;
        match changed.validate() {
            Ok(()) => {
                *self = changed;
                Ok(())
            }
            Err(conflict) => Err(SettingError::Conflict { key: setting.key, found: value.to_owned(), conflict }),
        }
    }

    /// Sets what `assignment`, such as `time_s=1.5`, says.
    pub fn set_assignment(&mut self, assignment: &str) -> Result<(), SettingError> {
        let (key, value) = assignment.split_once('=').ok_or_else(|| SettingError::NoValue(assignment.to_owned()))?;
        self.set(key.trim(), value)
    }

    /// The value of `key`, written so that [`Scene::set`] reads it back; `None` where the scene has nothing of the kind.
    pub fn get(&self, key: &str) -> Result<Option<String>, SettingError> {
        Ok(find(&self.settings(), key)?.get(self))
    }
}

/// The setting called `key`; `-` and `_` are the same.
fn find(settings: &[Setting], key: &str) -> Result<Setting, SettingError> {
    let wanted = key.replace('-', "_");
    let keys = || settings.iter().map(|setting| setting.key);
    let only_longer = || {
        let mut longer = keys().filter(|key| !wanted.is_empty() && key.starts_with(&wanted));
        longer.next().filter(|_| longer.next().is_none())
    };
    // A key without its group, `radiometry` or `exposure_ev`, is the likeliest slip after one of the fingers.
    let by_last_part = || {
        let last_part = |key: &'static str| key.rsplit('.').next().unwrap_or(key);
        let meant = nearest(wanted.rsplit('.').next().unwrap_or(&wanted), keys().map(last_part))?;
        keys().find(|key| last_part(key) == meant)
    };
    settings.iter().find(|setting| setting.key == wanted).cloned().ok_or_else(|| SettingError::UnknownKey {
        key: key.to_owned(),
        nearest: only_longer().or_else(|| nearest(&wanted, keys())).or_else(by_last_part),
        count: settings.len(),
    })
}

#[cfg(test)]
mod tests;
