use std::io::Cursor;

use super::read::split_name;
use super::*;
use crate::{Image, Layer, LayerSet};

/// Every class of float, with payloads: what a lossless file must bring back.
const AWKWARD: [u32; 12] = [
    0x0000_0000,
    0x8000_0000,
    0x3f80_0000,
    0xbf80_0001,
    0x7f80_0000,
    0xff80_0000,
    0x7fc0_0000,
    0xffc1_2345,
    0x7f80_0001,
    0x0000_0001,
    0x807f_ffff,
    0x7f7f_ffff,
];

/// A plane that walks through [`AWKWARD`] and plain numbers, different for every seed.
fn plane(width: u32, height: u32, seed: u32) -> Image<f32> {
    Image::from_fn(width, height, |x, y| {
        let at = (y * width + x + seed) as usize;
        if at.is_multiple_of(3) { at as f32 * -0.37 } else { f32::from_bits(AWKWARD[at % AWKWARD.len()]) }
    })
    .unwrap()
}

/// Four layers of 1 to 4 channels, one of them of another size.
fn layers() -> LayerSet {
    let mut set = LayerSet::new();
    for (name, channels, (width, height)) in
        [("color", 3, (37, 41)), ("depth", 1, (37, 41)), ("beams/map.uv", 2, (5, 64)), ("albedo", 4, (37, 41))]
    {
        set.push(Layer::new(name, (0..channels).map(|channel| plane(width, height, 7 * channel)).collect()).unwrap()).unwrap();
    }
    set
}

fn bits(layer: &Layer) -> Vec<Vec<u32>> {
    layer.planes().iter().map(|plane| plane.pixels().iter().map(|value| value.to_bits()).collect()).collect()
}

#[test]
fn every_bit_comes_back_with_names_order_and_size() {
    let written = layers();
    let read = decode(&encode(&written).unwrap()).unwrap();
    assert_eq!(read.names().collect::<Vec<_>>(), ["color", "depth", "beams/map.uv", "albedo"]);
    for (read, written) in read.iter().zip(&written) {
        assert_eq!((read.width(), read.height()), (written.width(), written.height()));
        assert_eq!(bits(read), bits(written), "layer {}", written.name());
    }
}

#[test]
fn a_single_layer_keeps_its_name() {
    let mut set = LayerSet::new();
    set.push(Layer::new("caustic_irradiance", vec![plane(3, 2, 0)]).unwrap()).unwrap();
    assert_eq!(decode(&encode(&set).unwrap()).unwrap().names().collect::<Vec<_>>(), ["caustic_irradiance"]);
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads_or_the_run() {
    let set = layers();
    let with = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| encode(&set).unwrap());
    let one = with(1);
    assert!(one == with(1) && one == with(2) && one == with(7));
}

#[test]
fn no_time_is_recorded() {
    let bytes = encode(&layers()).unwrap();
    for word in ["capDate", "timeCode", "utcOffset", "owner", "comments"] {
        assert!(!bytes.windows(word.len()).any(|window| window == word.as_bytes()), "the file mentions {word}");
    }
}

#[test]
fn an_empty_set_is_refused() {
    assert!(matches!(encode(&LayerSet::new()), Err(ExrError::NoLayers)));
}

#[test]
fn names_of_channels_say_the_layer() {
    for (part, channel, layer, name) in [
        (None, "R", "color", "R"),
        (None, "normal.X", "normal", "X"),
        (Some("normal"), "X", "normal", "X"),
        (Some("normal"), "normal.X", "normal", "X"),
        (Some("left"), "pass.normal.X", "left.pass.normal", "X"),
    ] {
        assert_eq!(split_name(part, channel), (layer.to_owned(), name.to_owned()));
    }
}

#[test]
fn half_floats_prefixes_and_tiles_of_other_writers_are_read() {
    use exr::prelude::*;
    let half = |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F16(vec![f16::from_f32(value); 12]));
    let list = SmallVec::from_vec(vec![
        half("R", 1.0),
        half("G", 2.0),
        half("B", 3.0),
        half("diffuse.B", 6.0),
        half("diffuse.R", 4.0),
        half("diffuse.G", 5.0),
    ]);
    let picture = Image::from_layer(Layer::new((4, 3), LayerAttributes::default(), Encoding::FAST_LOSSLESS, AnyChannels::sort(list)));
    let mut bytes = Cursor::new(Vec::new());
    picture.write().to_buffered(&mut bytes).unwrap();
    let read = decode(bytes.get_ref()).unwrap();
    assert_eq!(read.names().collect::<Vec<_>>(), ["color", "diffuse"]);
    let values = |name: &str| read.get(name).unwrap().planes().iter().map(|plane| plane.pixels()[11]).collect::<Vec<_>>();
    assert_eq!((values("color"), values("diffuse")), (vec![1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0]));
}

/// One part called `part` whose channels `R` and `G` count up, written by the crate `exr` itself.
fn foreign(compression: exr::prelude::Compression, blocks: exr::prelude::Blocks, position: (i32, i32)) -> Vec<u8> {
    use exr::prelude::*;
    let channel =
        |name: &str, first: f32| AnyChannel::new(name, FlatSamples::F32((0..20 * 11).map(|index| first + index as f32).collect()));
    let list = SmallVec::from_vec(vec![channel("R", 0.0), channel("G", 1000.0)]);
    let attributes = LayerAttributes::named("part").with_position(Vec2(position.0, position.1));
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let picture = Image::from_layer(Layer::new((20, 11), attributes, encoding, AnyChannels::sort(list)));
    let mut bytes = Cursor::new(Vec::new());
    picture.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn every_lossless_compression_is_read_in_lines_and_in_tiles() {
    use exr::prelude::{Blocks, Compression, Vec2};
    for compression in [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 4))] {
            // A data window that does not start at the origin moves no pixel.
            for position in [(0, 0), (-7, 300)] {
                let read = decode(&foreign(compression, blocks, position)).unwrap();
                let layer = read.get("part").unwrap();
                for (plane, first) in layer.planes().iter().zip([0.0, 1000.0]) {
                    let expected = Image::from_fn(20, 11, |x, y| first + (20 * y + x) as f32).unwrap();
                    assert_eq!(plane.pixels(), expected.pixels(), "{compression:?} {blocks:?} at {position:?}");
                }
            }
        }
    }
}

#[test]
fn lossy_compression_is_refused_by_name() {
    use exr::prelude::{Blocks, Compression};
    for compression in [Compression::PXR24, Compression::B44, Compression::B44A] {
        let error = decode(&foreign(compression, Blocks::ScanLines, (0, 0))).unwrap_err();
        assert!(matches!(error, ExrError::UnsupportedCompression { name, .. } if name == "part"), "{compression:?}");
    }
}

#[test]
fn integer_channels_are_refused_by_name() {
    use exr::prelude::*;
    let channel = AnyChannel::new("id", FlatSamples::U32(vec![0; 6]));
    let picture = Image::from_channels((3, 2), AnyChannels::sort(SmallVec::from_vec(vec![channel])));
    let mut bytes = Cursor::new(Vec::new());
    picture.write().to_buffered(&mut bytes).unwrap();
    assert!(matches!(decode(bytes.get_ref()), Err(ExrError::UnsupportedChannel { channel, .. }) if channel == "id"));
}

#[test]
fn every_truncation_is_an_error() {
    let mut set = LayerSet::new();
    set.push(Layer::new("color", vec![plane(9, 33, 0); 3]).unwrap()).unwrap();
    let bytes = encode(&set).unwrap();
    for length in 0..bytes.len() {
        assert!(decode(&bytes[..length]).is_err(), "the first {length} of {} bytes were accepted", bytes.len());
    }
}

#[test]
fn a_declared_size_beyond_the_bytes_is_refused() {
    let mut set = LayerSet::new();
    set.push(Layer::new("color", vec![plane(1 << 15, 1, 0)]).unwrap()).unwrap();
    let mut bytes = encode(&set).unwrap();
    // The data window is two corners, inclusive; widen it to 2^29 columns.
    let at = bytes.windows(10).position(|window| window == b"dataWindow").unwrap() + "dataWindow\0box2i\0".len() + 4;
    bytes[at + 8..at + 12].copy_from_slice(&((1_i32 << 29) - 1).to_le_bytes());
    assert!(matches!(decode(&bytes), Err(ExrError::Implausible { .. })), "{:?}", decode(&bytes).err());
}

#[test]
fn damaged_bytes_never_panic() {
    use exr::prelude::{Blocks, Compression, Vec2};
    let mut set = LayerSet::new();
    set.push(Layer::new("color", vec![plane(9, 7, 0); 3]).unwrap()).unwrap();
    set.push(Layer::new("depth", vec![plane(9, 7, 5)]).unwrap()).unwrap();
    let mut files = vec![encode(&set).unwrap()];
    for compression in [Compression::Uncompressed, Compression::RLE, Compression::PIZ, Compression::B44] {
        files.push(foreign(compression, Blocks::Tiles(Vec2(16, 8)), (0, 0)));
    }
    for bytes in files {
        // Every byte of the headers in turn, and some of the pixels, becomes each of a few telling values.
        for at in (0..bytes.len()).filter(|at| *at < 700 || at.is_multiple_of(13)) {
            for value in [0, 1, 0x7f, 0x80, 0xff, bytes[at] ^ 1] {
                let mut damaged = bytes.clone();
                damaged[at] = value;
                // Damage to a pixel cannot be noticed; any other answer than a panic will do.
                let _ = decode(&damaged);
            }
        }
    }
}
