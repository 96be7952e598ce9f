//! Values of the command line: how each type is read from a text and written so that it is read back.

use glam::Vec3;

use crate::trace::MeasuringPlane;

/// A kind of value that can be read from and written to the command line.
pub trait Value: Sized {
    /// The value that a text says; `None` if the text is not of this type.
    fn read(text: &str) -> Option<Self>;
    /// The value as a text that [`Value::read`] reads back.
    fn write(&self) -> String;
}

impl Value for f32 {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok().filter(|value: &f32| value.is_finite())
    }

    fn write(&self) -> String {
        self.to_string()
    }
}

impl Value for u32 {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok()
    }

    fn write(&self) -> String {
        self.to_string()
    }
}

impl Value for bool {
    fn read(text: &str) -> Option<Self> {
        match text {
            "true" | "on" | "yes" => Some(true),
            "false" | "off" | "no" => Some(false),
            _ => None,
        }
    }

    fn write(&self) -> String {
        self.to_string()
    }
}

impl Value for Vec3 {
    /// `r,g,b`, or one number for all three.
    fn read(text: &str) -> Option<Self> {
        let numbers: Option<Vec<f32>> = text.split(',').map(|part| f32::read(part.trim())).collect();
        match *numbers?.as_slice() {
            [all] => Some(Vec3::splat(all)),
            [x, y, z] => Some(Vec3::new(x, y, z)),
            _ => None,
        }
    }

    fn write(&self) -> String {
        format!("{},{},{}", self.x, self.y, self.z)
    }
}

impl Value for (u32, u32) {
    /// `128x64`.
    fn read(text: &str) -> Option<Self> {
        let (first, second) = text.split_once('x')?;
        Some((first.trim().parse().ok()?, second.trim().parse().ok()?))
    }

    fn write(&self) -> String {
        format!("{}x{}", self.0, self.1)
    }
}

impl Value for Option<(u32, u32)> {
    /// `none` or `128x64`.
    fn read(text: &str) -> Option<Self> {
        if text.eq_ignore_ascii_case("none") { Some(None) } else { Value::read(text).map(Some) }
    }

    fn write(&self) -> String {
        self.map_or_else(|| "none".to_owned(), |size| size.write())
    }
}

impl Value for Option<MeasuringPlane> {
    /// `none` or `0,0,0;1,0,0;0,0,1;64x32`: corner, u, v and texels.
    fn read(text: &str) -> Option<Self> {
        if text.eq_ignore_ascii_case("none") {
            return Some(None);
        }
        let parts: Vec<&str> = text.split(';').map(str::trim).collect();
        let [corner, u, v, texels] = *parts.as_slice() else { return None };
        Some(Some(MeasuringPlane { corner: Value::read(corner)?, u: Value::read(u)?, v: Value::read(v)?, texels: Value::read(texels)? }))
    }

    fn write(&self) -> String {
        self.map_or_else(|| "none".to_owned(), |p| format!("{};{};{};{}", p.corner.write(), p.u.write(), p.v.write(), p.texels.write()))
    }
}
