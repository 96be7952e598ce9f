//! Images through files, as a user of the library meets them.

use nephroid::image::{Image, Layer, LayerSet, STANDARD_LAYERS, ToneMap, file, openexr, png, write_atomically};

use crate::support::fnv1a as hash;

/// A picture with every kind of value: dark, bright, coloured, negative, infinite and NaN.
fn picture() -> Layer {
    let plane = |channel: u32| {
        Image::from_fn(64, 48, |x, y| match (x, y) {
            (0, 0) => f32::NAN,
            (1, 0) => f32::INFINITY,
            (2, 0) => f32::NEG_INFINITY,
            (3, 0) => -0.0,
            (4, 0) => -1.5,
            // Twelve stops along x, hue along y.
            _ => (1 << (x / 5)) as f32 / 256.0 * (1.0 + ((y + 16 * channel) % 48) as f32) / 48.0,
        })
        .unwrap()
    };
    Layer::new("color", (0..3).map(plane).collect()).unwrap()
}

fn bits(layer: &Layer) -> Vec<u32> {
    layer.planes().iter().flat_map(|plane| plane.pixels().iter().map(|value| value.to_bits())).collect()
}

#[test]
fn all_standard_layers_survive_a_file_bit_by_bit() {
    let color = picture();
    let mut layers = LayerSet::new();
    for (index, standard) in STANDARD_LAYERS.iter().enumerate() {
        let planes = (0..standard.channels).map(|channel| color.planes()[(index + channel) % 3].clone()).collect();
        layers.push(Layer::new(standard.name, planes).unwrap()).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("all.exr");
    write_atomically(&path, &openexr::encode(&layers).unwrap()).unwrap();
    let read = file::read(&path).unwrap().layers;
    assert!(read.names().eq(STANDARD_LAYERS.iter().map(|standard| standard.name)));
    for (read, written) in read.iter().zip(&layers) {
        assert_eq!(bits(read), bits(written), "{}", written.name());
    }
}

/// The codes of the picture are the same on every machine: the tone map and the curve use no function of the platform.
#[test]
fn display_codes_are_the_committed_ones() {
    let decoded = png::decode(&png::encode(&picture(), &ToneMap::default()).unwrap()).unwrap();
    let codes: Vec<u8> = decoded
        .planes()
        .iter()
        .flat_map(|plane| {
            plane.pixels().iter().map(|value| nephroid::image::tone::quantize_8bit(nephroid::image::tone::srgb_encode(*value)))
        })
        .collect();
    assert_eq!(codes.len(), 64 * 48 * 3);
    assert_eq!(hash(&codes), CODES_HASH, "the display codes changed: {:#018x}", hash(&codes));
}

/// Of the codes of [`picture`] under the default tone map, plane by plane.
const CODES_HASH: u64 = 0x3ab0_fdb9_89b9_1307;
