//! What a scene tells each technique: settings of groups that the scene module does not know, found by their type.

use std::any::Any;

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use super::field::Field;
use super::rows::{Group, Row, Settings};
use crate::check::{At, Invalid};
use crate::text::read::{Error, Value};

/// What the techniques are told, beyond the scene itself: one group of settings for each technique that the scene was read for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TechniqueSettings {
    groups: Vec<Box<dyn Settings>>,
}

impl TechniqueSettings {
    /// The defaults of these groups.
    #[must_use]
    pub fn new(known: &[&'static dyn Settings]) -> Self {
        Self { groups: known.iter().map(|group| group.defaults().boxed()).collect() }
    }

    /// The settings of one group; its defaults if the scene was not read for it.
    #[must_use]
    pub fn get<G: Group>(&self) -> &G {
        self.groups.iter().find_map(|group| as_any(&**group).downcast_ref()).unwrap_or(G::DEFAULTS)
    }

    /// The settings of one group, to be changed; they are valid only if [`Scene::validate`](crate::Scene::validate) says so.
    pub fn edit<G: Group>(&mut self) -> &mut G {
        let place = self.groups.iter().position(|group| as_any(&**group).is::<G>());
        let place = place.unwrap_or_else(|| {
            self.groups.push(G::DEFAULTS.boxed());
            self.groups.len() - 1
        });
        let group: &mut dyn Any = &mut *self.groups[place];
        group.downcast_mut().expect("the group was found by its type")
    }

    /// Takes the settings of one group in place of those that are there.
    pub fn replace(&mut self, settings: Box<dyn Settings>) {
        match self.groups.iter_mut().find(|group| group.key() == settings.key()) {
            Some(group) => *group = settings,
            None => self.groups.push(settings),
        }
    }

    /// Takes the values that make frames cheap enough for tests, in every group.
    pub fn coarsen(&mut self) {
        self.groups.iter_mut().for_each(|group| group.coarsen());
    }

    /// All groups, in the order of the table that the scene was read for.
    pub fn iter(&self) -> impl Iterator<Item = &dyn Settings> {
        self.groups.iter().map(|group| &**group)
    }

    /// The value of a row.
    pub(crate) fn field(&self, row: &Row) -> Option<&dyn Field> {
        self.groups.iter().find_map(|group| (row.field)(as_any(&**group)))
    }

    /// The value of a row, to be changed.
    pub(crate) fn field_mut(&mut self, row: &Row) -> Option<&mut dyn Field> {
        self.groups.iter_mut().find_map(|group| {
            let group: &mut dyn Any = &mut **group;
            (row.field_mut)(group)
        })
    }

    /// Reads the groups that a scene file has.
    pub(crate) fn read(&mut self, value: Value<'_>) -> Result<(), Error> {
        let names: Vec<&'static str> = self.groups.iter().map(|group| group.key()).collect();
        value.fields("TechniqueSettings", &names, |place, value| {
            let group = &mut *self.groups[place];
            let rows = group.rows();
            let names: Vec<&'static str> = rows.iter().map(|row| row.name).collect();
            value.fields(group.type_name(), &names, |place, value| {
                let group: &mut dyn Any = group;
                (rows[place].field_mut)(group).map_or(Ok(()), |field| field.read(value))
            })
        })
    }

    /// Checks every value and returns the first that is not allowed.
    pub(crate) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        self.groups.iter().try_for_each(|group| group.validate(at))
    }
}

fn as_any(group: &dyn Settings) -> &dyn Any {
    group
}

impl Serialize for TechniqueSettings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("TechniqueSettings", self.groups.len())?;
        for group in &self.groups {
            fields.serialize_field(group.key(), &**group)?;
        }
        fields.end()
    }
}

impl Serialize for dyn Settings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct(self.type_name(), self.rows().len())?;
        for row in self.rows() {
            if let Some(field) = (row.field)(self) {
                fields.serialize_field(row.name, &field.plain())?;
            }
        }
        fields.end()
    }
}
