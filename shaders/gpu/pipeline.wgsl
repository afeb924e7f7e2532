// twin: src/gpu/pipeline.rs
// Invocations of a dispatch.

/// Invocations of a workgroup.
const WG = 64u;

/// The number of a workgroup in a dispatch that may be folded into two dimensions.
fn number_of(workgroup: vec3<u32>, workgroups: vec3<u32>) -> u32 {
    return workgroup.x + workgroup.y * workgroups.x;
}

/// The index of this invocation in a dispatch that may be folded into two dimensions.
fn linear(gid: vec3<u32>, groups: vec3<u32>) -> u32 {
    return gid.x + gid.y * groups.x * WG;
}
