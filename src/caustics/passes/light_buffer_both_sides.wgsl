// Surfaces wherever they are.

@fragment
fn fs(in: Varyings) -> Targets {
    return targets_at(in);
}
