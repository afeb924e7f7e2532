//! Pictures: what must be in them, and that they are the same every time.

use encase::ShaderType;
use glam::DVec3;
use packstone::render::{self, ColorBy, Picture, Rod, View, colors, draw};
use packstone::scene::{Domain, Motion, Surface, Wall};

type Pixel = [u8; 4];

/// A device, or None where the environment allows that there is none.
fn device() -> Option<(wgpu::Device, wgpu::Queue)> {
    let descriptor = wgpu::InstanceDescriptor { ..wgpu::InstanceDescriptor::new_without_display_handle_from_env() };
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
    match adapter {
        Ok(adapter) => Some(pollster::block_on(adapter.request_device(&Default::default())).expect("a device")),
        Err(_) if std::env::var("PACKSTONE_ALLOW_NO_GPU").is_ok_and(|value| value == "1") => None,
        Err(error) => panic!(
            "no graphics adapter ({error}); install a software driver such as Mesa's lavapipe, or set \
             PACKSTONE_ALLOW_NO_GPU=1 to skip this test"
        ),
    }
}

/// Skips the rest of a test where there is no device.
macro_rules! device_or_return {
    () => {
        match device() {
            Some(device) => device,
            None => return,
        }
    };
}

fn picture(dimension: usize, grains: &[(DVec3, f64, [f32; 3])]) -> Picture {
    Picture {
        dimension,
        centers: grains.iter().map(|grain| grain.0).collect(),
        radii: grains.iter().map(|grain| grain.1).collect(),
        colors: grains.iter().map(|grain| grain.2).collect(),
        rods: Vec::new(),
        eye: Picture::EYE,
        up: DVec3::AXES[dimension - 1],
        walls: Vec::new(),
        domain: Domain { lower: -DVec3::INFINITY, upper: DVec3::INFINITY, ..Domain::default() },
        extent: None,
        width: 160,
        height: 120,
    }
}

fn floor(normal: DVec3) -> Wall {
    let surface = Surface::Plane { point: DVec3::ZERO, normal };
    Wall {
        name: "floor".into(),
        surface,
        velocity: DVec3::ZERO,
        spin: 0.0,
        motion: Motion::default(),
        servo: None,
        material: 0,
    }
}

fn pixels((device, queue): &(wgpu::Device, wgpu::Queue), picture: &Picture) -> Vec<Pixel> {
    let rgba = draw(device, queue, picture).expect("a picture");
    let pixels: Vec<Pixel> = rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
    assert_eq!(pixels.len(), (picture.width * picture.height) as usize);
    assert!(pixels.iter().all(|pixel| pixel[3] == 255));
    pixels
}

/// The four corners of a picture of the size made by `picture`.
fn corners(pixels: &[Pixel]) -> [Pixel; 4] {
    [pixels[0], pixels[159], pixels[119 * 160], pixels[119 * 160 + 159]]
}

fn is_red(pixel: &Pixel) -> bool {
    i32::from(pixel[0]) > i32::from(pixel[1]) + 40
}

const BLUE: [f32; 3] = [0.2, 0.45, 0.75];
const RED: [f32; 3] = [0.85, 0.15, 0.15];

#[test]
fn a_sphere_has_its_colour_and_leaves_the_corners_alone() {
    let device = device_or_return!();
    // Far from the origin and small: positions must be taken relative to the scene before they become f32.
    let empty = pixels(&device, &picture(3, &[]));
    let ball = pixels(&device, &picture(3, &[(DVec3::new(1e4, -2e4, 3e4), 1e-3, BLUE)]));
    let centre = ball[60 * 160 + 80];
    for channel in 0..3 {
        let difference = f32::from(centre[channel]) / 255.0 - BLUE[channel];
        assert!(difference.abs() < 0.15, "{centre:?}");
    }
    assert_eq!(corners(&ball), corners(&empty));
    assert!(empty[0].iter().all(|&channel| channel > 220), "{:?}", empty[0]);
    let changed = ball.iter().zip(&empty).filter(|(a, b)| a != b).count();
    // The disk is fitted to the height: about π/4 of its square.
    assert!((7000..11000).contains(&changed), "{changed} pixels");
}

#[test]
fn a_hidden_sphere_is_not_seen() {
    let device = device_or_return!();
    let (azimuth, elevation) = (-60f64.to_radians(), 24f64.to_radians());
    let to_eye = DVec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
    let red = |place: DVec3| {
        let grains = [(DVec3::ZERO, 1.0, BLUE), (place, 0.3, RED)];
        // The order of the grains must not matter.
        let counts = [grains, [grains[1], grains[0]]]
            .map(|grains| pixels(&device, &picture(3, &grains)).iter().filter(|pixel| is_red(pixel)).count());
        assert_eq!(counts[0], counts[1]);
        counts[0]
    };
    assert_eq!(red(-2.0 * to_eye), 0);
    assert!(red(2.0 * to_eye) > 100);
    assert!(red(DVec3::new(0.0, 0.0, 1.3)) > 100);
}

#[test]
fn a_wall_takes_shadow_and_a_wall_in_front_is_left_open() {
    let device = device_or_return!();
    let mut with_floor = picture(3, &[(DVec3::new(0.0, 0.0, 1.0), 1.0, BLUE)]);
    with_floor.walls = vec![floor(DVec3::Z)];
    let seen = pixels(&device, &with_floor);
    let empty = pixels(&device, &picture(3, &[]));
    let grey = |p: &Pixel| p[0].abs_diff(p[2]) < 20 && p[0] < 200;
    assert!(seen.iter().filter(|p| grey(p)).count() > 100, "no shadow");
    assert_eq!(corners(&seen), corners(&empty));
    // Seen from below, a floor is between the eye and the grain.
    with_floor.walls =
        vec![Wall { surface: Surface::Plane { point: 2.0 * DVec3::Z, normal: -DVec3::Z }, ..floor(DVec3::Z) }];
    let open = pixels(&device, &with_floor);
    let blue = |pixels: &[Pixel]| pixels.iter().filter(|p| p[2] > p[0].saturating_add(40)).count();
    assert!(blue(&open) > 2000, "{} blue pixels", blue(&open));
}

#[test]
fn a_heap_of_disks_is_drawn_the_same_twice() {
    let device = device_or_return!();
    let mut grains = Vec::new();
    for row in 0..6 {
        for k in 0..6 - row {
            let x = f64::from(2 * k + row);
            grains.push((DVec3::new(x, 1.0 + 1.75 * f64::from(row), 0.0), 1.0, if row == 0 { RED } else { BLUE }));
        }
    }
    for dimension in [2, 3] {
        let mut heap = picture(dimension, &grains);
        heap.walls = vec![floor(if dimension == 2 { DVec3::Y } else { DVec3::Z })];
        let first = pixels(&device, &heap);
        assert!(first.iter().any(is_red) && first.iter().any(|pixel| *pixel != first[0]));
        assert!(first == pixels(&device, &heap), "dimension {dimension}: two pictures differ");
    }
}

#[test]
fn tiles_meet_without_a_seam() {
    let device = device_or_return!();
    let mut wide = picture(2, &[(DVec3::ZERO, 1.0, BLUE)]);
    (wide.width, wide.height) = (4096, 40);
    let row = &pixels(&device, &wide)[20 * 4096..21 * 4096];
    let blue: Vec<usize> = (0..4096).filter(|&x| row[x][2] > row[x][0].saturating_add(40)).collect();
    assert!(blue.len() > 24, "{} pixels", blue.len());
    assert_eq!(blue.len(), blue[blue.len() - 1] - blue[0] + 1, "a gap");
    assert_eq!(blue[0] + blue[blue.len() - 1], 4095, "not centred");
}

#[test]
fn bad_pictures_are_refused_and_odd_grains_left_out() {
    let device = device_or_return!();
    let mut bad = picture(3, &[(DVec3::ZERO, 1.0, BLUE)]);
    bad.colors.clear();
    assert!(draw(&device.0, &device.1, &bad).unwrap_err().to_string().contains("0 colors"));
    let mut bad = picture(3, &[]);
    bad.width = 0;
    assert!(draw(&device.0, &device.1, &bad).is_err());
    let sound = (DVec3::ZERO, 1.0, BLUE);
    let lost = (DVec3::new(f64::NAN, 0.0, 0.0), 1.0, RED);
    assert!(pixels(&device, &picture(3, &[sound])) == pixels(&device, &picture(3, &[sound, lost])));
}

#[test]
fn the_uniform_is_laid_out_as_the_shader_says() {
    let module = naga::front::wgsl::parse_str(render::SHADER).expect("valid WGSL");
    let (flags, capabilities) = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::default());
    naga::valid::Validator::new(flags, capabilities).validate(&module).expect("valid WGSL");
    let view = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("View")).expect("struct View").1;
    let naga::TypeInner::Struct { members, span } = &view.inner else { panic!("View is no struct") };
    for (k, member) in members.iter().enumerate() {
        assert_eq!(u64::from(member.offset), View::METADATA.offset(k), "{:?}", member.name);
    }
    assert_eq!(u64::from(*span), View::min_size().get());
}

#[test]
fn a_png_can_be_read_back() {
    let path = tempfile::NamedTempFile::new().expect("a file").into_temp_path();
    let rgba: Vec<u8> = (0..4 * 3 * 2).collect();
    render::write_png(&path, 3, 2, &rgba).expect("written");
    let file = std::io::BufReader::new(std::fs::File::open(&path).expect("a file"));
    let mut reader = png::Decoder::new(file).read_info().expect("a header");
    let mut back = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut back).expect("pixels");
    assert_eq!((info.width, info.height, back), (3, 2, rgba));
    let missing = path.join("nowhere.png");
    let error = render::write_png(&missing, 1, 1, &[0; 4]).unwrap_err();
    assert!(error.to_string().contains("nowhere.png"));
    assert_eq!(colors(ColorBy::Id, &[0.0, 1.0]).len(), 2);
}

/// A rod between two points is where they are, turned to where up is, and its disks have no rims.
#[test]
fn rods_lie_between_their_ends() {
    let device = device_or_return!();
    let red = [0.9, 0.1, 0.1];
    let dark = |pixel: &Pixel| pixel[0] > 150 && pixel[1] < 90;
    for dimension in [2, 3] {
        // Across or upright, as the way up says.
        for (up, wide) in [(DVec3::AXES[dimension - 1], true), (DVec3::X, false)] {
            let mut picture = picture(dimension, &[]);
            let ends = [DVec3::ZERO, DVec3::X];
            picture.rods = vec![Rod { ends, radius: 0.05, color: red }];
            (picture.up, picture.eye) = (up, (-90.0, 0.0));
            let pixels = pixels(&device, &picture);
            let places: Vec<(u32, u32)> =
                (0..).zip(&pixels).filter(|(_, p)| dark(p)).map(|(k, _)| (k % 160, k / 160)).collect();
            let extent = |of: fn(&(u32, u32)) -> u32| {
                let (low, high) = (places.iter().map(of).min().unwrap(), places.iter().map(of).max().unwrap());
                high - low + 1
            };
            let (across, upright) = (extent(|p| p.0), extent(|p| p.1));
            println!("{dimension}: {across} x {upright}, {} pixels", places.len());
            assert_eq!(across > 5 * upright, wide, "{across} x {upright}");
            assert_eq!(upright > 5 * across, !wide, "{across} x {upright}");
            // All of it, without rims in between.
            assert!(places.len() as u32 > across * upright * 8 / 10, "{} of {across} x {upright}", places.len());
        }
    }
}

/// Grains of a tilted cell are drawn in it, whichever of its images they are in; in two dimensions, where the third axis has
/// no bounds, and in three with such an axis.
#[test]
fn grains_are_drawn_in_the_tilted_cell() {
    let device = device_or_return!();
    for dimension in [2, 3] {
        let domain = Domain {
            lower: DVec3::new(1.0, 2.0, f64::NEG_INFINITY),
            upper: DVec3::new(5.0, 6.0, f64::INFINITY),
            periodic: [true, true, false],
            tilt: DVec3::new(0.0, 0.0, 1.5),
            ..Domain::default()
        };
        let at = |x: DVec3| {
            let grains = [(DVec3::new(3.5, 3.0, 0.0), 0.3, BLUE), (x, 0.5, RED)];
            pixels(&device, &Picture { domain, ..picture(dimension, &grains) })
        };
        let inside = DVec3::new(5.2, 5.0, 0.0);
        let seen = at(inside);
        assert!(seen.iter().filter(|pixel| is_red(pixel)).count() > 200, "{dimension}D");
        assert!(at(inside - domain.edge(0)) == seen && at(inside - domain.edge(1)) == seen, "{dimension}D");
        // The frame is drawn.
        let bare = pixels(&device, &picture(dimension, &[(DVec3::new(3.5, 3.0, 0.0), 0.3, BLUE), (inside, 0.5, RED)]));
        assert_ne!(seen, bare, "{dimension}D");
    }
}

/// In the box of all of them, what is alike in the pictures of a series is in the same place, walls included, wherever other
/// grains go; and all of them are in it.
#[test]
fn pictures_of_a_series_have_one_view() {
    let device = device_or_return!();
    for dimension in [2, 3] {
        let up = DVec3::AXES[dimension - 1];
        let at = |x: DVec3| {
            let mut picture = picture(dimension, &[(1e-3 * up, 1e-3, BLUE), (1e-3 * x, 1e-3, RED)]);
            picture.walls = vec![floor(up)];
            picture
        };
        let all = [3.0 * DVec3::X + up, 2.0 * DVec3::X + 12.0 * up].map(at);
        let extents = all.each_ref().map(|picture| render::extent(picture).unwrap());
        let extent = Some([extents[0][0].min(extents[1][0]), extents[0][1].max(extents[1][1])]);
        let seen = all.map(|picture| pixels(&device, &Picture { extent, ..picture }));
        let places = |pixels: &[Pixel], of: fn(&Pixel) -> bool| {
            let found = pixels.iter().enumerate().filter(|(_, pixel)| of(pixel)).map(|(k, _)| k);
            found.collect::<Vec<_>>()
        };
        let is_blue = |pixel: &Pixel| pixel[2] > pixel[0].saturating_add(60);
        let blue = seen.each_ref().map(|pixels| places(pixels, is_blue));
        let same = blue[0].iter().filter(|place| blue[1].contains(place)).count();
        println!("{dimension}D: {} and {} pixels, {same} in common", blue[0].len(), blue[1].len());
        // Shadows of the other one aside.
        assert!(same > 50 && same * 10 > 9 * blue[0].len().max(blue[1].len()), "{dimension}D");
        assert!(seen.iter().all(|pixels| pixels.iter().filter(|pixel| is_red(pixel)).count() > 50), "{dimension}D");
        let corner = seen.each_ref().map(|pixels| pixels[160 * 119]);
        assert_eq!(corner[0], corner[1]);
    }
}
