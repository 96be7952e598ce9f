//! Scene files: no bytes panic, and whatever is accepted is valid and prints.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nephroid_caustics::TECHNIQUES;

fuzz_target!(|bytes: &[u8]| {
    match TECHNIQUES.parse_bytes(bytes, "fuzz.ron", Path::new("")) {
        Ok(scene) => {
            assert_eq!(scene.validate(), Ok(()), "an accepted scene is valid");
            for setting in scene.settings() {
                if let Some(value) = setting.get(&scene) {
                    let mut again = scene.clone();
                    assert_eq!(again.set(setting.key, &value), Ok(()), "{} takes the value it reports", setting.key);
                }
            }
        }
        Err(error) => assert!(error.to_string().starts_with("fuzz.ron:"), "every error names the file"),
    }
});
