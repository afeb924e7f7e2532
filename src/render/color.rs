//! Colours of grains, laid out in the Oklab space so that equal steps of a value look like equal steps of colour.

use std::f32::consts::TAU;

/// What the colour of a grain shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorBy {
    /// Values are radii, m.
    Radius,
    /// Values are speeds, m/s.
    Speed,
    /// Values are sizes that count from 0: forces, numbers of contacts.
    Size,
    /// Values are whole numbers of grains (or of materials); each gets a hue of its own.
    Id,
}

/// The values that the two ends of the map of colours stand for; None where every value has a hue of its own, or there
/// is none. `least` is what the upper end is at least.
pub fn range(by: ColorBy, values: &[f64], least: f64) -> Option<[f64; 2]> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let high = finite().fold(f64::NEG_INFINITY, f64::max).max(least);
    let low = match by {
        ColorBy::Speed | ColorBy::Size => 0.0,
        ColorBy::Radius => finite().fold(f64::INFINITY, f64::min),
        ColorBy::Id => return None,
    };
    (low.is_finite() && high.is_finite()).then_some([low, high])
}

/// One sRGB colour, 0 to 1, per value. All but numbers run from dark blue (lowest) over green to yellow (highest); a
/// value that is not finite is grey.
pub fn colors(by: ColorBy, values: &[f64]) -> Vec<[f32; 3]> {
    colors_between(by, values, range(by, values, f64::NEG_INFINITY))
}

/// The same between these ends of the map.
pub fn colors_between(by: ColorBy, values: &[f64], range: Option<[f64; 2]>) -> Vec<[f32; 3]> {
    let [low, high] = range.unwrap_or([f64::NAN; 2]);
    let span = high - low;
    // Values that are all alike up to rounding sit in the middle of the map.
    let flat = span.is_nan() || span <= 1e-9 * low.abs() || span <= f64::MIN_POSITIVE;
    let color = |&value: &f64| match by {
        _ if !value.is_finite() => [0.6; 3],
        ColorBy::Id => distinct(value),
        ColorBy::Speed | ColorBy::Size if flat => ramp(0.0),
        ColorBy::Radius if flat => ramp(0.5),
        ColorBy::Radius | ColorBy::Speed | ColorBy::Size => ramp(((value - low) / span) as f32),
    };
    values.iter().map(color).collect()
}

/// Colour at `t` from 0 to 1 of the map: lightness grows evenly while the hue turns from violet-blue to yellow.
pub fn ramp(t: f32) -> [f32; 3] {
    let t = t.clamp(0.0, 1.0);
    let hue = 285.0 - 180.0 * t;
    oklch(0.36 + 0.53 * t, 0.115 + 0.055 * t * t, hue / 360.0)
}

/// Hues a golden-ratio turn apart, so that consecutive numbers never look alike; lightness alternates a little.
fn distinct(id: f64) -> [f32; 3] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    const SILVER: f64 = std::f64::consts::SQRT_2 - 1.0;
    let hue = (id * GOLDEN).rem_euclid(1.0) as f32;
    let lightness = 0.62 + 0.16 * (id * SILVER).rem_euclid(1.0) as f32;
    oklch(lightness, 0.125, hue)
}

/// sRGB of an Oklab colour given by lightness, chroma and hue (in turns), with the chroma lowered until it exists.
fn oklch(lightness: f32, chroma: f32, hue: f32) -> [f32; 3] {
    let (sin, cos) = (hue * TAU).sin_cos();
    let fits = |rgb: &[f32; 3]| rgb.iter().all(|c| (0.0..=1.0).contains(c));
    (0..20)
        .map(|step| chroma * (1.0 - 0.05 * step as f32))
        .map(|chroma| linear_from_oklab(lightness, chroma * cos, chroma * sin))
        .find(fits)
        .unwrap_or([lightness.powi(3); 3])
        .map(srgb_from_linear)
}

/// The published Oklab matrices (Ottosson 2020), inverted.
fn linear_from_oklab(lightness: f32, a: f32, b: f32) -> [f32; 3] {
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
}

fn srgb_from_linear(channel: f32) -> f32 {
    if channel <= 0.003_130_8 { 12.92 * channel } else { 1.055 * channel.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_grows_lighter_and_stays_in_range() {
        let luminance = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let map = colors(ColorBy::Radius, &[1.0, 1.2, 1.4, 1.6, 1.8, 2.0]);
        assert!(map.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
        assert!(map.windows(2).all(|pair| luminance(pair[0]) + 0.05 < luminance(pair[1])), "{map:?}");
    }

    /// What trembles at rest has the colour of rest, beside the speed of a flow.
    #[test]
    fn noise_is_no_flow() {
        let speeds = [3e-9, 1e-8, 0.0];
        let range = range(ColorBy::Speed, &speeds, 1e-3);
        assert_eq!(range, Some([0.0, 1e-3]));
        let found = colors_between(ColorBy::Speed, &speeds, range);
        assert!(found.iter().flatten().zip([ramp(0.0); 3].iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-3));
        assert_eq!(super::range(ColorBy::Speed, &[2.0, 1.0], 1e-3), Some([0.0, 2.0]));
        assert_eq!(super::range(ColorBy::Radius, &[2.0, 1.0], f64::NEG_INFINITY), Some([1.0, 2.0]));
        assert_eq!(super::range(ColorBy::Id, &[2.0], f64::NEG_INFINITY), None);
    }

    #[test]
    fn odd_values_get_a_color() {
        assert_eq!(colors(ColorBy::Speed, &[f64::NAN])[0], [0.6; 3]);
        // Powers may be rounded otherwise where the compiler takes them.
        let same = |a: [f32; 3], b: [f32; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-6);
        assert!(same(colors(ColorBy::Speed, &[0.0, 0.0])[0], ramp(0.0)));
        assert!(same(colors(ColorBy::Radius, &[0.1, 0.1])[1], ramp(0.5)));
        assert!(colors(ColorBy::Id, &[]).is_empty());
        let ids = colors(ColorBy::Id, &[0.0, 1.0]);
        assert!((0..3).any(|k| (ids[0][k] - ids[1][k]).abs() > 0.2));
    }
}
