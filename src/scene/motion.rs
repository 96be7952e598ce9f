//! Things that move: places, directions and turns of a scene as functions of time.
//!
//! A [`Motion`] names one value of the scene and gives it a [`Course`]. [`Scene::at`] is the scene at a moment, with these values in place. Each moment is a
//! function of the description and the time, whatever was asked before.

use std::borrow::Cow;
use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::check::{At, Invalid};
use super::description::MAX_TIME_S;
use super::{Aim, Camera, Light, Scene, SceneError};

/// Most motions of one scene.
pub const MAX_MOTIONS: usize = 64;

/// Most keys of one course.
const MAX_KEYS: usize = 4096;

/// A value that moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Which value.
    pub of: Moving,
    /// How.
    pub course: Course,
}

/// Values that can move.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Moving {
    /// The eye, m.
    CameraPosition,
    /// What the camera looks at, m.
    CameraTarget,
    /// Where the point or spot with this number is, counted from 0, m.
    LightPosition(u32),
    /// Which way the light with this number shines: that of the sun's rays, or a spot's axis; of any length above 0.
    LightDirection(u32),
    /// Where the object with this name is, m: its `transform.translate`.
    ObjectTranslate(String),
    /// How the object with this name is turned, degrees about x, y and z: its `transform.rotate_deg`.
    ObjectRotateDeg(String),
}

/// A vector as a function of time, in the unit of what moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Course {
    /// It passes through `(time in s, value)` one after another in straight lines, and rests before the first and after the last. 1..=4096 keys, times rising.
    Keys(Vec<(f32, Vec3)>),
    /// It runs in a level circle, from +x towards +z.
    Circle {
        /// Middle of the circle.
        center: Vec3,
        /// Radius of the circle. 0..=1e6.
        radius: f32,
        /// Time for one turn in seconds; negative runs the other way. Not 0, −1e6..=1e6.
        period_s: f32,
        /// Where it starts, in degrees from +x towards +z. Any finite number. Default: 0
        #[serde(default)]
        start_deg: f32,
    },
    /// It swings around a middle: `middle + swing·sin(2π·t/period + start)`.
    Swing {
        /// Middle of the swing.
        middle: Vec3,
        /// Farthest distance from the middle, along each axis.
        swing: Vec3,
        /// Time for one swing to and fro in seconds. Above 0, at most 1e6.
        period_s: f32,
        /// Phase at time 0, degrees. Any finite number. Default: 0
        #[serde(default)]
        start_deg: f32,
    },
}

impl Course {
    /// The vector at a time.
    #[must_use]
    pub fn at(&self, time_s: f32) -> Vec3 {
        let time_s = f64::from(time_s);
        let turn = |period_s: f32, start_deg: f32| {
            let turns = time_s / f64::from(period_s) + f64::from(start_deg) / 360.0;
            libm::sincos((turns - turns.floor()) * TAU)
        };
        match *self {
            Self::Keys(ref keys) => {
                let next = keys.partition_point(|(time, _)| f64::from(*time) <= time_s);
                match (next.checked_sub(1).and_then(|i| keys.get(i)), keys.get(next)) {
                    (Some((t0, p0)), Some((t1, p1))) => {
                        let f = (time_s - f64::from(*t0)) / (f64::from(*t1) - f64::from(*t0));
                        p0.as_dvec3().lerp(p1.as_dvec3(), f).as_vec3()
                    }
                    (Some((_, p)), None) | (None, Some((_, p))) => *p,
                    (None, None) => Vec3::ZERO,
                }
            }
            Self::Circle { center, radius, period_s, start_deg } => {
                let (sine, cosine) = turn(period_s, start_deg);
                (center.as_dvec3() + DVec3::new(cosine, 0.0, sine) * f64::from(radius)).as_vec3()
            }
            Self::Swing { middle, swing, period_s, start_deg } => {
                let (sine, _) = turn(period_s, start_deg);
                (middle.as_dvec3() + swing.as_dvec3() * sine).as_vec3()
            }
        }
    }

    /// Moves the course by minus `origin`.
    pub(super) fn shift(&mut self, origin: DVec3) {
        let shift = |p: &mut Vec3| *p = (p.as_dvec3() - origin).as_vec3();
        match self {
            Self::Keys(keys) => keys.iter_mut().for_each(|(_, p)| shift(p)),
            Self::Circle { center: p, .. } | Self::Swing { middle: p, .. } => shift(p),
        }
    }

    fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        let vector = |at: &At<'_>, v: Vec3| at.point(v);
        let period = |at: &At<'_>, period_s: f32, low: f32| {
            at.require(
                (low..=1.0e6).contains(&period_s) && period_s != 0.0,
                period_s,
                "a number up to 1e6 s that is not 0, above 0 for a swing",
            )
        };
        let angle = |at: &At<'_>, deg: f32| at.require(deg.is_finite(), deg, "a finite number of degrees");
        match self {
            Self::Keys(keys) => {
                at.list(keys.len(), 1..=MAX_KEYS)?;
                let mut before = f32::NEG_INFINITY;
                for (index, (time_s, value)) in keys.iter().enumerate() {
                    let at = at.index(index);
                    at.within(*time_s, 0.0..=MAX_TIME_S, "s")?;
                    at.require(*time_s > before, time_s, "a time later than that of the key before")?;
                    before = *time_s;
                    vector(&at, *value)?;
                }
                Ok(())
            }
            Self::Circle { center, radius, period_s, start_deg } => {
                vector(&at.field("center"), *center)?;
                at.field("radius").within(*radius, 0.0..=1.0e6, "")?;
                period(&at.field("period_s"), *period_s, -1.0e6)?;
                angle(&at.field("start_deg"), *start_deg)
            }
            Self::Swing { middle, swing, period_s, start_deg } => {
                vector(&at.field("middle"), *middle)?;
                vector(&at.field("swing"), *swing)?;
                period(&at.field("period_s"), *period_s, 0.0)?;
                angle(&at.field("start_deg"), *start_deg)
            }
        }
    }
}

impl Motion {
    pub(super) fn validate(&self, scene: &Scene, at: &At<'_>) -> Result<(), Invalid> {
        let of = at.field("of");
        let light = |number: u32, lamp: bool| {
            let found = scene.lights.get(number as usize);
            let fits = found.is_some_and(|light| !lamp || !light.is_directional());
            of.require(fits, number, if lamp { "the number of a point or spot" } else { "the number of a light" })
        };
        match &self.of {
            Moving::CameraPosition | Moving::CameraTarget => {}
            Moving::LightPosition(number) => light(*number, true)?,
            Moving::LightDirection(number) => {
                light(*number, false)?;
                let aimed = !matches!(scene.lights[*number as usize], Light::Point { .. });
                of.require(aimed, number, "the number of a directional light or a spot")?;
            }
            Moving::ObjectTranslate(name) | Moving::ObjectRotateDeg(name) => {
                let count = scene.objects.iter().filter(|object| object.name == *name).count();
                of.require(count == 1, format!("a name that {count} objects have"), "the name of one object")?;
            }
        }
        self.course.validate(&at.field("course"))
    }

    /// Whether the value is a place, which moves with the origin.
    pub(super) fn is_place(&self) -> bool {
        !matches!(self.of, Moving::LightDirection(_) | Moving::ObjectRotateDeg(_))
    }
}

impl Scene {
    /// The scene at a moment: its time, and all that moves where it is then.
    ///
    /// # Errors
    /// If a value is not allowed there, such as a time beyond that of the water, or an eye in what it looks at.
    pub fn at(&self, time_s: f32) -> Result<Self, Invalid> {
        let mut scene = Self { time_s, ..self.clone() };
        for motion in &self.motion {
            scene.place(&motion.of, motion.course.at(time_s));
        }
        scene.validate()?;
        Ok(scene)
    }

    /// The scene as it is computed with: at the origin if it is far away ([`Self::recentred`]), with all that moves where it is at the scene's own time.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub fn settled(&self) -> Result<Cow<'_, Self>, SceneError> {
        let centred = self.recentred();
        if self.motion.is_empty() {
            return Ok(centred.map_or(Cow::Borrowed(self), Cow::Owned));
        }
        let scene = centred.as_ref().unwrap_or(self);
        scene.at(self.time_s).map(Cow::Owned).map_err(|invalid| self.source.value_error(invalid))
    }

    fn place(&mut self, of: &Moving, value: Vec3) {
        match of {
            Moving::CameraPosition | Moving::CameraTarget => match &mut self.camera {
                Camera::Perspective { position, target, .. } | Camera::Orthographic { position, target, .. } => {
                    *(if *of == Moving::CameraPosition { position } else { target }) = value;
                }
            },
            Moving::LightPosition(number) => {
                if let Some(Light::Point { position, .. } | Light::Spot { position, .. }) = self.lights.get_mut(*number as usize) {
                    *position = value;
                }
            }
            Moving::LightDirection(number) => match self.lights.get_mut(*number as usize) {
                Some(Light::Directional { aim, .. }) => *aim = Aim::Along(value),
                Some(Light::Spot { direction, .. }) => *direction = value,
                Some(Light::Point { .. }) | None => {}
            },
            Moving::ObjectTranslate(name) => {
                self.objects.iter_mut().filter(|object| object.name == *name).for_each(|object| object.transform.translate = value);
            }
            Moving::ObjectRotateDeg(name) => {
                self.objects.iter_mut().filter(|object| object.name == *name).for_each(|object| object.transform.rotate_deg = value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn parse(motion: &str) -> Result<Scene, String> {
        let text = format!(
            "(
            camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)),
            lights: [Point(position: (0, 1, 0), intensity: (1, 1, 1)), Directional(aim: Sun(elevation_deg: 50), irradiance: (1, 1, 1))],
            objects: [(name: \"boat\", shape: Grid(size_m: (1, 1))), (name: \"twin\", shape: Grid(size_m: (1, 1))), (name: \"twin\", shape: Grid(size_m: (1, 1)))],
            motion: [{motion}],
        )"
        );
        crate::parse(&text, "motion", Path::new(""), &[]).map_err(|error| error.to_string())
    }

    #[test]
    fn keys_are_passed_in_straight_lines_with_rest_at_both_ends() {
        let course = Course::Keys(vec![(1.0, Vec3::ZERO), (3.0, Vec3::new(2.0, -4.0, 0.0)), (4.0, Vec3::X)]);
        for (time, expected) in [(0.0, Vec3::ZERO), (1.5, Vec3::new(0.5, -1.0, 0.0)), (3.0, Vec3::new(2.0, -4.0, 0.0)), (9.0, Vec3::X)] {
            assert_eq!(course.at(time), expected, "at {time} s");
        }
    }

    #[test]
    fn circles_and_swings_come_round() {
        let circle = Course::Circle { center: Vec3::Y, radius: 2.0, period_s: 4.0, start_deg: 90.0 };
        for (time, expected) in [(0.0, Vec3::new(0.0, 1.0, 2.0)), (1.0, Vec3::new(-2.0, 1.0, 0.0)), (4.0, Vec3::new(0.0, 1.0, 2.0))] {
            assert!(circle.at(time).distance(expected) < 1e-6, "{} at {time} s", circle.at(time));
        }
        let swing = Course::Swing { middle: Vec3::ONE, swing: Vec3::new(0.0, 3.0, 0.0), period_s: 2.0, start_deg: 0.0 };
        for (time, height) in [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0), (1.5, -2.0), (2000.5, 4.0)] {
            assert!((swing.at(time).y - height).abs() < 1e-5, "{} at {time} s", swing.at(time));
        }
    }

    #[test]
    fn what_moves_is_where_its_course_says() {
        let keys = |of: &str| format!("(of: {of}, course: Keys([(0, (0, 1, 0)), (2, (0, -1, 4))]))");
        let of = ["CameraPosition", "LightPosition(0)", "LightDirection(1)", "ObjectTranslate(\"boat\")", "ObjectRotateDeg(\"boat\")"];
        let scene = parse(&of.map(keys).join(", ")).expect("the scene is valid");
        let (moved, expected) = (scene.at(1.0).expect("valid at 1 s"), Vec3::new(0.0, 0.0, 2.0));
        let Light::Point { position, .. } = moved.lights[0] else { panic!("a point") };
        let boat = moved.objects[0].transform;
        assert_eq!([moved.camera.position_ws(), position, boat.translate, boat.rotate_deg], [expected; 4]);
        assert_eq!((moved.lights[1].incident(Vec3::ZERO).direction_ws, moved.time_s), (Vec3::Z, 1.0));
        assert_eq!(moved.objects[1], scene.objects[1]);
        // Another moment does not depend on the one before.
        assert_eq!(moved.at(2.0).expect("valid"), scene.at(2.0).expect("valid"));
    }

    #[test]
    fn bad_motions_are_refused_with_their_place() {
        for (motion, expected) in [
            ("(of: LightPosition(1), course: Keys([(0, (0, 0, 0))]))", "motion[0].of: found 1, expected the number of a point or spot"),
            ("(of: LightDirection(0), course: Keys([(0, (0, 0, 0))]))", "expected the number of a directional light or a spot"),
            ("(of: LightPosition(7), course: Keys([(0, (0, 0, 0))]))", "found 7"),
            ("(of: ObjectTranslate(\"twin\"), course: Keys([(0, (0, 0, 0))]))", "a name that 2 objects have"),
            ("(of: CameraTarget, course: Keys([]))", "motion[0].course"),
            ("(of: CameraTarget, course: Keys([(1, (0, 0, 0)), (1, (0, 0, 0))]))", "a time later than that of the key before"),
            ("(of: CameraTarget, course: Swing(middle: (0, 0, 0), swing: (0, 1, 0), period_s: -1))", "motion[0].course.period_s: found -1"),
            ("(of: CameraTarget, course: Circle(center: (0, 0, 0), radius: 1, period_s: 0))", "motion[0].course.period_s: found 0"),
        ] {
            let error = parse(motion).expect_err("it is refused");
            assert!(error.starts_with("motion:") && error.contains(expected), "{error}");
        }
        let into_the_target = parse("(of: CameraPosition, course: Keys([(0, (0, 1, 0)), (2, (0, -1, 0))]))").expect("valid at 0 s");
        assert!(into_the_target.at(1.0).is_err(), "the eye is in what it looks at");
    }
}
