// Pictures of packings. Lengths are in units of the scene's size, with the scene's centre at the origin and z up.
//
// In three dimensions: a shadow map, then the number of the thing seen in every sample (a visibility buffer, so that
// shading runs once per sample however deep the packing is), then the darkening of walls by the grains near them,
// then light. In two dimensions: background, wall lines and disks, painted in this order. Both end in `resolve`.

struct View {
    view_proj: mat4x4f,
    shadow_proj: mat4x4f,
    eye: vec3f,
    line_width: f32,      // in samples
    ray: vec3f,           // from the eye through the centre of the tile ...
    penumbra: f32,        // radius of the shadow filter, as a fraction of the map
    ray_x: vec3f,         // ... and what to add for its right edge
    shadow_offset: f32,   // length by which a lit point is lifted off its surface
    ray_y: vec3f,         // ... and for its upper edge
    tile_low: f32,        // height of the lower edge of the tile in the picture, 0 to 1
    light: vec3f,         // unit vector towards the key light
    tile_high: f32,
    light_x: vec3f,       // axes of the shadow map
    rim: f32,             // width of the dark rim of a disk, in samples
    light_y: vec3f,
    samples: vec2f,       // size of the tile in samples
}

// Normal of a wall, pointing to the grains, and its offset: `dot(n, x) = d`. With `round.w > 0` the face is a strip
// of the cylinder of that radius about the vertical through `round.xy`.
struct Face {
    plane: vec4f,
    round: vec4f,
}

struct Line {
    start: vec4f,
    end: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
// Centre and radius of each grain.
@group(0) @binding(1) var<storage, read> grains: array<vec4f>;
// sRGB, 8 bits a channel, red lowest.
@group(0) @binding(2) var<storage, read> colors: array<u32>;
// Grains that darken grain i: neighbours[starts[i]] up to neighbours[starts[i + 1]].
@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> neighbours: array<u32>;
// Corners of wall triangles; w is the face.
@group(0) @binding(5) var<storage, read> corners: array<vec4f>;
@group(0) @binding(6) var<storage, read> faces: array<Face>;
@group(0) @binding(7) var<storage, read> lines: array<Line>;
// Grains that a pass draws; each pass has its own part of the list.
@group(0) @binding(8) var<storage, read> drawn: array<u32>;

@group(1) @binding(0) var seen: texture_2d<u32>;
@group(1) @binding(1) var wall_openness: texture_2d<f32>;
@group(1) @binding(2) var shadow_map: texture_depth_2d;
@group(1) @binding(3) var shadow_sampler: sampler_comparison;
@group(1) @binding(4) var fine_picture: texture_2d<f32>;

// `seen` holds 0 for the background, 1 + grain, or this bit and the face.
const WALL: u32 = 0x80000000u;
// A grain darkens nothing farther from its centre than this many of its radii.
const REACH: f32 = 2.4;
const SHADOW_TAPS: u32 = 10u;
// Rotation by the golden angle.
const GOLDEN_TURN = mat2x2f(-0.7373688, 0.6754903, -0.6754903, -0.7373688);
// From the right, a little above the horizon; casts no shadow.
const FILL_LIGHT = vec3f(0.951, -0.168, 0.259);
const WALL_COLOR = vec3f(0.83, 0.84, 0.86);
const LINE_COLOR = vec3f(0.30, 0.32, 0.35);
const THICK_LINE_COLOR = vec3f(0.055, 0.065, 0.08);

// ---------------------------------------------------------------- geometry

// Corner k = 0..5 of two triangles that make the square [-1, 1]².
fn square_corner(k: u32) -> vec2f {
    let right = k == 1u || k == 2u || k == 4u;
    let upper = k == 2u || k == 4u || k == 5u;
    return vec2f(select(-1.0, 1.0, right), select(-1.0, 1.0, upper));
}

// Corner of the square that just covers a ball as the eye sees it.
fn covering_corner(center: vec3f, radius: f32, corner: vec2f) -> vec3f {
    let axis = center - view.eye;
    let distance2 = dot(axis, axis);
    let half_width = radius * sqrt(distance2 / max(distance2 - radius * radius, 1e-6 * distance2));
    let x = normalize(cross(axis, view.ray_y));
    let y = normalize(cross(x, axis));
    return center + half_width * (corner.x * x + corner.y * y);
}

// Unit vector from the eye through a sample.
fn ray_through(sample: vec2f) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * sample / view.samples + vec2f(-1.0, 1.0);
    return normalize(view.ray + ndc.x * view.ray_x + ndc.y * view.ray_y);
}

struct Hit {
    // Squared distance of the ray to the centre over the squared radius; above 1 the ray misses.
    miss: f32,
    normal: vec3f,
}

// Where a ray from the eye enters a ball. The miss distance is taken from the component across the ray: the usual
// discriminant would lose all digits for a small grain far away.
fn enter_ball(grain: vec4f, ray: vec3f) -> Hit {
    let center = grain.xyz - view.eye;
    let across = (dot(center, ray) * ray - center) / grain.w;
    let miss = dot(across, across);
    return Hit(miss, across - sqrt(max(1.0 - miss, 0.0)) * ray);
}

fn meet_plane(plane: vec4f, ray: vec3f) -> vec3f {
    let distance = (plane.w - dot(plane.xyz, view.eye)) / dot(plane.xyz, ray);
    return view.eye + distance * ray;
}

fn face_normal(face: Face, point: vec3f) -> vec3f {
    if face.round.w > 0.0 {
        return vec3f(normalize(face.round.xy - point.xy), 0.0);
    }
    return face.plane.xyz;
}

// Share of the sky over `normal` that a ball hides from `point`, weighted by cosine: exact where the ball is wholly
// above the horizon, a smooth blend where the horizon cuts it, faded out at REACH.
fn hidden_sky(point: vec3f, normal: vec3f, ball: vec4f) -> f32 {
    let to_center = (ball.xyz - point) / ball.w;
    let distance2 = max(dot(to_center, to_center), 1.0);
    let height = dot(to_center, normal);
    let cut = 0.5 * max(height + 1.0, 0.0);
    let exposed = select(cut * cut, height, height > 1.0);
    let fade = saturate(1.0 - distance2 / (REACH * REACH));
    return saturate(exposed * inverseSqrt(distance2) / distance2) * (1.0 - (1.0 - fade) * (1.0 - fade));
}

// ---------------------------------------------------------------- shadow map

struct ShadowBall {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) grain: u32,
    @location(1) local: vec2f,
}

@vertex
fn shadow_ball(@builtin(vertex_index) vertex: u32) -> ShadowBall {
    let grain = drawn[vertex / 6u];
    let local = square_corner(vertex % 6u);
    let ball = grains[grain];
    let place = ball.xyz + ball.w * (local.x * view.light_x + local.y * view.light_y);
    return ShadowBall(view.shadow_proj * vec4f(place, 1.0), grain, local);
}

@fragment
fn shadow_depth(in: ShadowBall) -> @builtin(frag_depth) f32 {
    let across = dot(in.local, in.local);
    if across > 1.0 {
        discard;
    }
    let ball = grains[in.grain];
    let towards = sqrt(1.0 - across) * view.light + in.local.x * view.light_x + in.local.y * view.light_y;
    return (view.shadow_proj * vec4f(ball.xyz + ball.w * towards, 1.0)).z;
}

// ---------------------------------------------------------------- what is seen

struct Thing {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) number: u32,
}

struct Seen {
    @location(0) number: u32,
    @builtin(frag_depth) depth: f32,
}

@vertex
fn see_ball(@builtin(vertex_index) vertex: u32) -> Thing {
    let grain = drawn[vertex / 6u];
    let ball = grains[grain];
    let place = covering_corner(ball.xyz, ball.w, square_corner(vertex % 6u));
    return Thing(view.view_proj * vec4f(place, 1.0), grain);
}

@fragment
fn seen_ball(in: Thing) -> Seen {
    let ball = grains[in.number];
    let hit = enter_ball(ball, ray_through(in.clip.xy));
    if hit.miss > 1.0 {
        discard;
    }
    let clip = view.view_proj * vec4f(ball.xyz + ball.w * hit.normal, 1.0);
    return Seen(in.number + 1u, clip.z / clip.w);
}

@vertex
fn see_wall(@builtin(vertex_index) vertex: u32) -> Thing {
    let corner = corners[vertex];
    return Thing(view.view_proj * vec4f(corner.xyz, 1.0), WALL | u32(corner.w));
}

@fragment
fn seen_wall(in: Thing) -> @location(0) u32 {
    return in.number;
}

// ---------------------------------------------------------------- darkening of walls, multiplied grain by grain

@vertex
fn reach_of_ball(@builtin(vertex_index) vertex: u32) -> Thing {
    let grain = drawn[vertex / 6u];
    let ball = grains[grain];
    let place = covering_corner(ball.xyz, REACH * ball.w, square_corner(vertex % 6u));
    return Thing(view.view_proj * vec4f(place, 1.0), grain);
}

@fragment
fn darken_wall(in: Thing) -> @location(0) vec4f {
    let number = textureLoad(seen, vec2u(in.clip.xy), 0).x;
    if (number & WALL) == 0u {
        discard;
    }
    let face = faces[number & ~WALL];
    let point = meet_plane(face.plane, ray_through(in.clip.xy));
    return vec4f(1.0 - hidden_sky(point, face_normal(face, point), grains[in.number]));
}

// ---------------------------------------------------------------- light

@vertex
fn whole_tile(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    return vec4f(f32(vertex & 1u) * 4.0 - 1.0, f32(vertex & 2u) * 2.0 - 1.0, 0.0, 1.0);
}

fn linear_from_srgb(color: vec3f) -> vec3f {
    return select(pow((color + 0.055) / 1.055, vec3f(2.4)), color / 12.92, color <= vec3f(0.04045));
}

fn grain_color(grain: u32) -> vec3f {
    return linear_from_srgb(unpack4x8unorm(colors[grain]).rgb);
}

// Rods of two dimensions are rows of disks without rims.
fn has_rim(grain: u32) -> bool {
    return (colors[grain] >> 24u) != 0u;
}

// Light neutral, a little darker towards the bottom.
fn background(sample: vec2f) -> vec3f {
    let height = mix(view.tile_high, view.tile_low, sample.y / view.samples.y);
    return mix(vec3f(0.80, 0.82, 0.85), vec3f(0.96, 0.965, 0.97), smoothstep(0.0, 0.9, height));
}

// A number in [0, 1) that differs between neighbouring samples: turns banding of the shadow filter into fine grain.
fn dither(sample: vec2f) -> f32 {
    return fract(41.7 * fract(dot(floor(sample), vec2f(0.7548777, 0.5698403))));
}

// Share of the key light that reaches a point, by taps on a golden-angle spiral over the penumbra.
fn key_light(point: vec3f, normal: vec3f, sample: vec2f) -> f32 {
    let lifted = point + view.shadow_offset * (normal + view.light);
    let clip = view.shadow_proj * vec4f(lifted, 1.0);
    let uv = clip.xy * vec2f(0.5, -0.5) + 0.5;
    let turn = 6.2831853 * dither(sample);
    var direction = vec2f(cos(turn), sin(turn));
    var lit = 0.0;
    for (var tap = 0u; tap < SHADOW_TAPS; tap++) {
        let place = uv + view.penumbra * sqrt((f32(tap) + 0.5) / f32(SHADOW_TAPS)) * direction;
        direction = GOLDEN_TURN * direction;
        lit += textureSampleCompareLevel(shadow_map, shadow_sampler, place, clip.z);
    }
    return lit / f32(SHADOW_TAPS);
}

fn sky(normal: vec3f) -> vec3f {
    return mix(vec3f(0.30, 0.285, 0.275), vec3f(0.56, 0.59, 0.64), 0.5 + 0.5 * normal.z);
}

fn lit_grain(grain: u32, ray: vec3f, sample: vec2f) -> vec3f {
    let ball = grains[grain];
    let normal = enter_ball(ball, ray).normal;
    let point = ball.xyz + ball.w * normal;
    var open = 1.0;
    for (var k = starts[grain]; k < starts[grain + 1u]; k++) {
        open *= 1.0 - hidden_sky(point, normal, grains[neighbours[k]]);
    }
    let facing = dot(normal, view.light);
    var key = 0.0;
    if facing > 0.0 {
        key = key_light(point, normal, sample);
    }
    let half_way = normalize(view.light - ray);
    let edge = pow(1.0 - saturate(-dot(normal, ray)), 4.0);
    // Light that bounces between grains is not traced; what it would miss is made up for by contrast in the gaps.
    open *= open;
    let fill = 0.16 * saturate(dot(normal, FILL_LIGHT));
    let diffuse = sky(normal) * open + key * facing * vec3f(0.88, 0.845, 0.79) + fill * open;
    let gloss = 0.16 * key * pow(saturate(dot(normal, half_way)), 48.0) + 0.05 * edge * open;
    return grain_color(grain) * diffuse + gloss;
}

fn lit_wall(face: Face, ray: vec3f, sample: vec2f) -> vec3f {
    let point = meet_plane(face.plane, ray);
    let normal = face_normal(face, point);
    let open = textureLoad(wall_openness, vec2u(sample), 0).x;
    let facing = dot(normal, view.light);
    var key = 0.0;
    if facing > 0.0 {
        key = facing * key_light(point, normal, sample);
    }
    return WALL_COLOR * (vec3f(0.66, 0.675, 0.70) * mix(0.12, 1.0, open) + key * vec3f(0.44, 0.425, 0.40));
}

// Leaves colours up to 0.8 alone and bends brighter ones towards 1.
fn soft_clip(color: vec3f) -> vec3f {
    let excess = max(color - 0.8, vec3f(0.0));
    return min(color, vec3f(0.8)) + excess / (1.0 + 5.0 * excess);
}

@fragment
fn lit(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let sample = position.xy;
    let number = textureLoad(seen, vec2u(sample), 0).x;
    if number == 0u {
        return vec4f(background(sample), 1.0);
    }
    let ray = ray_through(sample);
    if (number & WALL) != 0u {
        return vec4f(soft_clip(lit_wall(faces[number & ~WALL], ray, sample)), 1.0);
    }
    return vec4f(soft_clip(lit_grain(number - 1u, ray, sample)), 1.0);
}

// ---------------------------------------------------------------- lines of one width in the picture

@vertex
fn thin_line(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let line = lines[vertex / 6u];
    let corner = square_corner(vertex % 6u);
    let from_clip = view.view_proj * vec4f(line.start.xyz, 1.0);
    let to_clip = view.view_proj * vec4f(line.end.xyz, 1.0);
    let along = normalize((to_clip.xy / to_clip.w - from_clip.xy / from_clip.w) * view.samples + vec2f(1e-9, 0.0));
    var clip = select(from_clip, to_clip, corner.x > 0.0);
    let shift = view.line_width * (corner.y * vec2f(-along.y, along.x) + corner.x * along) / view.samples;
    // Nudged towards the eye, or the wall it bounds would hide half of it.
    return vec4f(clip.xy + shift * clip.w, clip.z - 2e-5 * clip.w, clip.w);
}

@fragment
fn thin_line_color() -> @location(0) vec4f {
    return vec4f(LINE_COLOR, 0.85);
}

// ---------------------------------------------------------------- two dimensions

@fragment
fn backdrop(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return vec4f(background(position.xy), 1.0);
}

// A wall of width start.w, lying beyond the line so that grains touch its edge; end.z, end.w is its inward normal.
@vertex
fn thick_line(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let line = lines[vertex / 6u];
    let corner = square_corner(vertex % 6u);
    let normal = line.end.zw;
    let along = vec2f(normal.y, -normal.x);
    let end = select(line.start.xy, line.end.xy, corner.x > 0.0);
    let direction = sign(dot(line.end.xy - line.start.xy, along)) * corner.x;
    let out = line.start.w * 0.5 * (corner.y + 1.0);
    let overhang = select(0.0, line.start.w * 0.5, line.start.z > 0.0);
    return view.view_proj * vec4f(end - out * normal + overhang * direction * along, 0.0, 1.0);
}

@fragment
fn thick_line_color() -> @location(0) vec4f {
    return vec4f(THICK_LINE_COLOR, 1.0);
}

@vertex
fn disk(@builtin(vertex_index) vertex: u32) -> ShadowBall {
    let grain = vertex / 6u;
    let local = square_corner(vertex % 6u);
    let ball = grains[grain];
    return ShadowBall(view.view_proj * vec4f(ball.xy + ball.w * local, 0.0, 1.0), grain, local);
}

// Flat colour, a little lighter to the upper left, with a rim of constant width that never eats a small disk.
@fragment
fn disk_color(in: ShadowBall) -> @location(0) vec4f {
    let radius = length(in.local);
    let sample = fwidth(in.local.x);
    if radius > 1.0 {
        discard;
    }
    let base = grain_color(in.grain);
    let glow = 1.03 + 0.17 * dot(in.local, vec2f(-0.55, 0.83)) - 0.12 * radius * radius;
    let rim = min(view.rim * sample, 0.22);
    let inside = select(1.0, 1.0 - smoothstep(1.0 - rim - sample, 1.0 - rim + sample, radius), has_rim(in.grain));
    return vec4f(soft_clip(base * mix(0.33, glow, inside)), 1.0);
}

// ---------------------------------------------------------------- from samples to pixels

@fragment
fn resolve(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let corner = 2u * vec2u(position.xy);
    var sum = textureLoad(fine_picture, corner, 0) + textureLoad(fine_picture, corner + vec2u(1u, 0u), 0);
    sum += textureLoad(fine_picture, corner + vec2u(0u, 1u), 0) + textureLoad(fine_picture, corner + vec2u(1u, 1u), 0);
    return 0.25 * sum;
}
