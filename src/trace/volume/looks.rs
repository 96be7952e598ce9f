//! What the corners of pixels show: where views part, pixels are cut.

use arrayvec::ArrayVec;
use glam::Vec3;

use super::super::eye::{Eye, MAX_CROSSINGS, Stretch};

/// Parts along each side of a pixel whose corners see different things.
pub(super) const CUT: u32 = 4;

/// Pixels of a row of which one may be cut; the others that would be are not.
const CUT_SHARE: u32 = 4;

/// Largest distance of what the corners see from the plane of what the middle sees, as a share of their distance from it.
const FLATNESS: f32 = 0.2;

/// A view, as straight parts, and the object at its end.
#[derive(Clone, Debug, Default)]
pub(super) struct Look {
    pub stretches: ArrayVec<Stretch, { MAX_CROSSINGS as usize }>,
    object: Option<u32>,
}

impl Look {
    fn new(eye: &Eye<'_>, x: f64, y: f64) -> Self {
        let mut stretches = ArrayVec::new();
        let seen = eye.look(x, y, |stretch| stretches.push(stretch));
        Self { stretches, object: seen.map(|seen| seen.object) }
    }

    /// Whether two views took the same way up to a straight part with this number.
    pub fn agrees(&self, other: &Self, number: usize) -> bool {
        let places = |look: &Self| look.stretches.iter().take(number + 1).map(|stretch| stretch.place).collect::<ArrayVec<_, 8>>();
        self.stretches.len() > number && places(self) == places(other)
    }

    fn took_the_way_of(&self, other: &Self) -> bool {
        self.stretches.len() == other.stretches.len() && self.agrees(other, self.stretches.len() - 1)
    }

    fn shows_the_same(&self, corner: &Self) -> bool {
        self.object == corner.object
            && self.stretches.len() == corner.stretches.len()
            && self.stretches.iter().zip(&corner.stretches).all(|(middle, corner)| {
                let plane = Plane::at_end(middle);
                let to = end(corner) - end(middle);
                middle.place == corner.place
                    && middle.length.is_finite() == corner.length.is_finite()
                    && (middle.length.is_infinite() || plane.normal.dot(to).abs() <= FLATNESS * to.length())
            })
    }
}

fn end(stretch: &Stretch) -> Vec3 {
    stretch.origin + stretch.direction * stretch.length
}

/// The plane at which the views of a part end: places with `n·p ≥ d` are before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub normal: Vec3,
    pub d: f32,
}

impl Plane {
    /// The plane at the end of a straight part; all places are before it if the part has no end.
    pub fn at_end(stretch: &Stretch) -> Self {
        let normal = stretch.end_normal;
        let d = if stretch.length.is_finite() { normal.dot(end(stretch)) } else { -1.0 };
        Self { normal, d }
    }

    /// The range of a ray before the plane.
    #[inline(always)]
    pub fn clip(&self, origin: Vec3, direction: Vec3, (from, to): (f32, f32)) -> (f32, f32) {
        let (height, slope) = (self.normal.dot(origin) - self.d, self.normal.dot(direction));
        let s = -height / slope;
        if slope > 0.0 {
            (from.max(s), to)
        } else if slope < 0.0 {
            (from, to.min(s))
        } else if height >= 0.0 {
            (from, to)
        } else {
            (from, from)
        }
    }
}

/// A pixel or a part of one: the views through its corners, in the order of rows, and through its middle.
pub(super) struct Part<'a> {
    pub corners: [&'a Look; 4],
    pub middle: &'a Look,
    /// Number of the part in its pixel by rows, and how many there are.
    pub number: u32,
    pub count: u32,
}

/// Calls `visit` with every part of every pixel of a row. Of the pixels that are to be cut, those whose corners took different ways come first.
pub(super) fn parts_of_row(eye: &Eye<'_>, row: u32, mut visit: impl FnMut(u32, Part<'_>)) {
    let columns = eye.columns();
    let y = f64::from(row);
    let line = |y: f64| (0..=columns).map(|x| Look::new(eye, f64::from(x), y)).collect::<Vec<_>>();
    let (above, below) = (line(y), line(y + 1.0));
    let corners = |column: u32| {
        let k = column as usize;
        [&above[k], &above[k + 1], &below[k], &below[k + 1]]
    };
    let middles: Vec<Look> = (0..columns).map(|column| Look::new(eye, f64::from(column) + 0.5, y + 0.5)).collect();
    let mut cuts = columns.div_ceil(CUT_SHARE);
    let mut cut = vec![false; columns as usize];
    let pixels = || (0..columns).zip(&middles);
    let parts_ways = |(column, middle): &(u32, &Look)| !corners(*column).iter().all(|corner| middle.took_the_way_of(corner));
    let shows_more = |(column, middle): &(u32, &Look)| !corners(*column).iter().all(|corner| middle.shows_the_same(corner));
    for (column, _) in pixels().filter(parts_ways).chain(pixels().filter(shows_more)) {
        if cuts > 0 && !cut[column as usize] {
            cut[column as usize] = true;
            cuts -= 1;
        }
    }
    for (column, middle) in pixels() {
        if cut[column as usize] {
            parts_of_pixel(eye, f64::from(column), y, |part| visit(column, part));
        } else {
            visit(column, Part { corners: corners(column), middle, number: 0, count: 1 });
        }
    }
}

/// Calls `visit` with the parts of a pixel that is cut.
fn parts_of_pixel(eye: &Eye<'_>, x: f64, y: f64, mut visit: impl FnMut(Part<'_>)) {
    let at = |i: u32| f64::from(i) / f64::from(CUT);
    let half = 0.5 / f64::from(CUT);
    let grid: Vec<Look> = (0..(CUT + 1) * (CUT + 1)).map(|i| Look::new(eye, x + at(i % (CUT + 1)), y + at(i / (CUT + 1)))).collect();
    for number in 0..CUT * CUT {
        let (i, j) = (number % CUT, number / CUT);
        let first = (j * (CUT + 1) + i) as usize;
        let corners = [0, 1, CUT as usize + 1, CUT as usize + 2].map(|step| &grid[first + step]);
        let middle = Look::new(eye, x + at(i) + half, y + at(j) + half);
        visit(Part { corners, middle: &middle, number, count: CUT * CUT });
    }
}
