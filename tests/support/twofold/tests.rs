use nephroid::caustics::{RenderOptions, Renderer};

use super::{TECHNIQUE, Twofold};
use crate::support::{scene_of_size, techniques};

/// Direct and caustic irradiance of every pixel, red, of a scene that is partly in the dry.
fn irradiance(factor: f32, samples: u32) -> (Vec<f32>, Vec<f32>) {
    let mut scene = scene_of_size("ring.ron", (32, 24));
    *scene.techniques.edit::<Twofold>() = Twofold { factor, samples, shadow_map_size: 64, ..Twofold::default() };
    let layers = Some(["direct", "caustic_irradiance"].map(str::to_owned).to_vec());
    let options = RenderOptions { technique: TECHNIQUE.name().to_owned(), techniques: techniques(), layers, ..RenderOptions::default() };
    let rendered = Renderer::new(&scene, &options).expect("a renderer").render(&scene, None).expect("a picture").layers;
    let red = |name: &str| rendered.get(name).expect("the layer was asked for").planes()[0].pixels().to_vec();
    (red("direct"), red("caustic_irradiance"))
}

#[test]
fn twofold_is_twice_the_direct_irradiance_to_the_last_bit() {
    for samples in [1, 2] {
        let (direct, twice) = irradiance(Twofold::default().factor, samples);
        assert!(direct.iter().any(|&e| e > 0.0) && direct.contains(&0.0), "some pixels are lit and some are not");
        for (direct, twice) in direct.iter().zip(&twice) {
            assert_eq!((direct * 2.0).to_bits(), twice.to_bits(), "{samples} samples");
        }
    }
}

#[test]
fn another_factor_is_noticed() {
    let (direct, twice) = irradiance(3.0, 1);
    assert!(direct.iter().zip(&twice).any(|(direct, twice)| direct * 2.0 != *twice));
    assert!(direct.iter().zip(&twice).all(|(direct, thrice)| direct * 3.0 == *thrice));
}
