//! The state of a run as bytes. A run that continues from its state gives the same bits as an uninterrupted one.

use nephroid_scene::Scene;

use super::audit::Audit;
use super::batch::DIRECT_BATCHES;
use super::error::TraceError;
use super::statistics::Accumulator;
use super::tracer::Tracer;

/// First bytes of a state, with the version.
const MAGIC: &[u8; 16] = b"nephroid trace 2";

/// Header of a state.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 16],
    fingerprint: u64,
    batches: u64,
    audit: Audit,
    /// Number of texels of the plane, of the pixels, of the volume, of direct irradiance and of direct light in media.
    texels: [u64; 5],
    /// Checksum of all bytes after the header.
    sum: u64,
}

/// FNV-1a.
fn check_sum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

impl Tracer {
    /// Checksum of all inputs of the results, except the number of photons. Meshes from files are represented by their bounds.
    fn fingerprint(&self) -> u64 {
        // Sky, tone map and settings of techniques do not affect photons.
        let Scene {
            image,
            camera,
            lights,
            environment: _,
            water,
            medium,
            smoke,
            objects,
            time_s,
            tone: _,
            techniques: _,
            motion: _,
            trace,
            title: _,
            source: _,
            origin: _,
        } = self.scene();
        let (options, bounds) = (&self.options, self.world.bounds);
        let text = format!(
            "{image:?} {camera:?} {lights:?} {water:?} {medium:?} {smoke:?} {objects:?} {time_s:?} {trace:?} {} {} {} {:?} {bounds:?}",
            options.seed, options.camera, options.volume, options.points
        );
        check_sum(text.as_bytes())
    }

    /// All that the run has measured, for [`Tracer::restore`].
    #[must_use]
    pub fn state(&self) -> Vec<u8> {
        let parts = self.run.accumulators();
        let mut body = Vec::new();
        for part in parts.into_iter().flatten() {
            body.extend_from_slice(part.state().0);
        }
        body.extend_from_slice(&self.run.hits);
        let header = Header {
            magic: *MAGIC,
            fingerprint: self.fingerprint(),
            batches: self.run.batches,
            audit: self.run.audit,
            texels: parts.map(|part| part.as_ref().map_or(0, |a| a.len() as u64)),
            sum: check_sum(&body),
        };
        let mut bytes = bytemuck::bytes_of(&header).to_vec();
        bytes.append(&mut body);
        bytes
    }

    /// Continues a run from the result of [`Tracer::state`]. The scene and all options must be the same.
    ///
    /// # Errors
    /// If the state is damaged or belongs to another run.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), TraceError> {
        let (head, body) = bytes.split_at_checked(size_of::<Header>()).ok_or(TraceError::BadState("it is too short"))?;
        let header: Header = bytemuck::pod_read_unaligned(head);
        if header.magic != *MAGIC {
            return Err(TraceError::BadState("it does not start as a state of this version does"));
        }
        let expected = self.fingerprint();
        if header.fingerprint != expected {
            let hex = |value: u64| format!("{value:016x}");
            return Err(TraceError::OtherState {
                what: "the digest of scene and options",
                found: hex(header.fingerprint),
                expected: hex(expected),
            });
        }
        if header.sum != check_sum(body) {
            return Err(TraceError::BadState("its check sum is wrong"));
        }
        let mut rest = body;
        let direct = header.batches.min(DIRECT_BATCHES);
        for (number, part) in self.run.accumulators_mut().into_iter().enumerate() {
            let Some(part) = part else { continue };
            let length = part.state().0.len();
            let (mine, others) = rest.split_at_checked(length).ok_or(TraceError::BadState("it is too short"))?;
            restore(part, mine, if number == 3 { direct } else { header.batches })?;
            rest = others;
        }
        if rest.len() != self.run.hits.len() {
            return Err(TraceError::BadState("it has another length"));
        }
        self.run.hits.copy_from_slice(rest);
        (self.run.audit, self.run.batches) = (header.audit, header.batches);
        Ok(())
    }
}

fn restore(part: &mut Accumulator, bytes: &[u8], batches: u64) -> Result<(), TraceError> {
    part.restore(bytes, batches).ok_or(TraceError::BadState("its pictures have another size"))
}
