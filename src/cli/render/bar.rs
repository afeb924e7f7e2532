//! Bars that tell what colours and widths stand for.

use packstone::render::ramp;
use plotters::{
    prelude::*,
    style::{
        FontStyle, register_font,
        text_anchor::{HPos, Pos, VPos},
    },
};
use std::sync::Once;

const FONT: &str = "sans-serif";
/// Parts of the height of a picture: length of the bar, its width, the size of letters and the way from the edge.
const LENGTH: f64 = 0.45;
const WIDTH: f64 = 0.022;
const LETTERS: f64 = 0.026;
const EDGE: f64 = 0.03;
/// Numbers beside the bar.
const TICKS: u32 = 4;

/// What is said of one of the things that a picture shows.
pub enum Bar {
    /// What the ends of the map of colours stand for; `title` says what is shown, and its unit.
    Colors { title: &'static str, range: [f64; 2] },
    /// What the thickest of the rods stands for, the others being as much thinner as they have less.
    Rods { title: &'static str, most: f64 },
}

/// Into the lower left corner of a picture of 4 bytes a pixel, one above the other.
pub fn draw(pixels: &mut [u8], (width, height): (u32, u32), bars: &[Bar]) -> anyhow::Result<()> {
    static FONTS: Once = Once::new();
    FONTS.call_once(|| {
        let known = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
        assert!(known.is_ok(), "the embedded font is a font");
    });
    let mut opaque: Vec<u8> = pixels.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    {
        let area = BitMapBackend::with_buffer(&mut opaque, (width, height)).into_drawing_area();
        let part = |part: f64| (part * f64::from(height)) as i32;
        let style = |h, v| (FONT, part(LETTERS).max(9)).into_font().color(&BLACK).pos(Pos::new(h, v));
        let (left, mut bottom) = (part(EDGE), height as i32 - part(EDGE));
        let right = left + part(WIDTH).max(3);
        let beside = right + part(EDGE) / 3;
        for bar in bars {
            let (title, length) = match bar {
                Bar::Colors { title, .. } => (title, LENGTH),
                Bar::Rods { title, .. } => (title, LENGTH / 3.0),
            };
            // Over grains letters would not be seen.
            let (wide, high) = (part(0.55 * LETTERS * title.len().max(11) as f64), part(length + 2.0 * LETTERS));
            let margin = part(EDGE) / 3;
            let panel = [(left - margin, bottom - high), (left + wide + margin, bottom + margin)];
            area.draw(&Rectangle::new(panel, WHITE.mix(0.75).filled()))?;
            let top = match bar {
                Bar::Colors { range: [low, high], .. } => {
                    let top = bottom - part(LENGTH);
                    for y in top..bottom {
                        let t = f64::from(bottom - y) / f64::from(bottom - top);
                        let [r, g, b] = ramp(t as f32).map(|c| (c * 255.0).round() as u8);
                        // A rectangle without a height is not drawn.
                        area.draw(&Rectangle::new([(left, y), (right, y + 1)], RGBColor(r, g, b).filled()))?;
                    }
                    area.draw(&Rectangle::new([(left, top), (right, bottom)], BLACK.stroke_width(1)))?;
                    for tick in 0..=TICKS {
                        let t = f64::from(tick) / f64::from(TICKS);
                        let y = bottom - (t * f64::from(bottom - top)) as i32;
                        area.draw(&Rectangle::new([(right, y), (right + part(EDGE) / 4, y + 1)], BLACK.filled()))?;
                        let text = number(low + t * (high - low));
                        area.draw(&Text::new(text, (beside, y), style(HPos::Left, VPos::Center)))?;
                    }
                    top
                }
                Bar::Rods { most, .. } => {
                    let top = bottom - part(LENGTH) / 3;
                    let (middle, thin) = ((left + right) / 2, 1.max((right - left) / 12));
                    let wedge = [(middle - thin, bottom), (left, top), (right, top), (middle + thin, bottom)];
                    area.draw(&Polygon::new(wedge, BLACK.filled()))?;
                    for (y, value) in [(bottom, 0.0), (top, *most)] {
                        area.draw(&Text::new(number(value), (beside, y), style(HPos::Left, VPos::Center)))?;
                    }
                    top
                }
            };
            let above = (left, top - part(LETTERS) / 2);
            area.draw(&Text::new((*title).to_owned(), above, style(HPos::Left, VPos::Bottom)))?;
            bottom = top - part(3.0 * LETTERS);
        }
        area.present()?;
    }
    for (pixel, new) in pixels.chunks_exact_mut(4).zip(opaque.chunks_exact(3)) {
        pixel[..3].copy_from_slice(new);
    }
    Ok(())
}

/// With three digits, as short as it can be said.
fn number(x: f64) -> String {
    let plain = x == 0.0 || (1e-2..1e4).contains(&x.abs());
    if !plain {
        return format!("{x:.2e}");
    }
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).max(0) as usize };
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_short() {
        let cases =
            [(0.0, "0"), (1.0, "1"), (0.125, "0.125"), (123.456, "123"), (2.5e-7, "2.50e-7"), (-3e5, "-3.00e5")];
        cases.iter().for_each(|(x, text)| assert_eq!(number(*x), *text));
    }
}
