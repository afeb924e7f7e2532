//! One picture per suite, as SVG and PNG: error over wall time per simulated second, or speed over size.

use super::{Point, Suite};
use crate::{
    error::{Error, Result},
    io::{at, replace},
};
use plotters::{
    coord::Shift,
    prelude::*,
    style::{FontStyle, register_font},
};
use std::{collections::BTreeSet, fs::File, io::BufWriter, ops::Range, path::Path, sync::Once};

/// Pixels of a panel.
const WIDTH: u32 = 480;
const HEIGHT: u32 = 360;
/// Pixels of the strip above them that tells which colour is which engine.
const LEGEND: u32 = 32;
/// Panels side by side.
const COLUMNS: usize = 3;
const FONT: &str = "sans-serif";

/// Engines with the colours they have everywhere: blue, vermilion and green that colour-blind eyes tell apart.
const SERIES: [(&str, &str, RGBColor); 3] = [
    ("cpu", "double", RGBColor(0, 114, 178)),
    ("gpu", "single", RGBColor(213, 94, 0)),
    ("gpu", "double", RGBColor(0, 158, 115)),
];

/// Draw a suite to `NAME.svg` and `NAME.png`, if it has anything to draw.
///
/// # Errors
/// [`Error::Io`] if a file cannot be written.
pub fn write(folder: &Path, suite: Suite, points: &[Point]) -> Result<()> {
    embed_font();
    let points: Vec<&Point> = points.iter().filter(|p| p.suite == suite).collect();
    let panels: Vec<Panel> = panels(suite, &points).collect();
    if panels.is_empty() {
        return Ok(());
    }
    let columns = panels.len().min(COLUMNS);
    let rows = panels.len().div_ceil(columns);
    let size = (WIDTH * columns as u32, LEGEND + HEIGHT * rows as u32);
    let mut svg = String::new();
    draw(&SVGBackend::with_string(&mut svg, size).into_drawing_area(), &panels, (rows, columns))?;
    let path = folder.join(format!("{}.svg", suite.name()));
    replace(&path, |part| std::fs::write(part, &svg).map_err(at(part)))?;

    let mut pixels = vec![0; (3 * size.0 * size.1) as usize];
    draw(&BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area(), &panels, (rows, columns))?;
    let path = folder.join(format!("{}.png", suite.name()));
    replace(&path, |part| {
        let mut encoder = png::Encoder::new(BufWriter::new(File::create(part).map_err(at(part))?), size.0, size.1);
        encoder.set_color(png::ColorType::Rgb);
        let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels));
        written.map_err(|e| at(part)(std::io::Error::other(e)))
    })
}

/// Text is drawn with a font of our own, so that pictures look the same on machines without any.
fn embed_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let known = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
        assert!(known.is_ok(), "the embedded font is a font");
    });
}

/// A diagram.
pub struct Panel<'a> {
    title: String,
    axes: (&'static str, String),
    points: Vec<Dot<'a>>,
    /// Whether a line joins the Pareto front, or the points of each series.
    front: bool,
}

struct Dot<'a> {
    at: (f64, f64),
    label: String,
    point: &'a Point,
}

/// One panel per case and quantity with at least one positive error; of speeds, one per scene.
pub fn panels<'a>(suite: Suite, points: &'a [&'a Point]) -> Box<dyn Iterator<Item = Panel<'a>> + 'a> {
    if suite == Suite::Speed {
        return Box::new(scenes(points));
    }
    let mut groups = Vec::new();
    for group in points.iter().filter(|p| p.error.is_some()).map(|p| (p.case.as_str(), p.quantity)) {
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    let panel = |(case, quantity): (&str, &'static str)| {
        let same = points.iter().filter(move |p| (p.case.as_str(), p.quantity) == (case, quantity));
        let dots: Vec<Dot> = same.filter_map(|point| errors(point)).collect();
        let unit = dots.first()?.point.unit;
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        let axes = ("wall seconds per simulated second", format!("error{unit}"));
        Some(Panel { title: format!("{case}: {quantity}"), axes, points: dots, front: true })
    };
    Box::new(groups.into_iter().filter_map(panel))
}

fn errors(point: &Point) -> Option<Dot<'_>> {
    let at = (point.wall_per_simulated?, point.error?);
    positive(at).then(|| Dot { at, label: format!("×{}", point.dt_over_auto), point })
}

fn scenes<'a>(points: &'a [&'a Point]) -> impl Iterator<Item = Panel<'a>> + 'a {
    let scene = |p: &'a Point| p.case.split(' ').next().unwrap_or("");
    let names: BTreeSet<&str> = points.iter().map(|p| scene(p)).collect();
    names.into_iter().rev().filter_map(move |name| {
        let speed = |point: &'a &Point| {
            let at = (point.grains? as f64, point.particle_steps_per_second?);
            positive(at).then(|| Dot { at, label: String::new(), point })
        };
        let dots: Vec<Dot> = points.iter().filter(|p| scene(p) == name).filter_map(speed).collect();
        let axes = ("grains", "particle-steps per second".to_owned());
        (!dots.is_empty()).then(|| Panel { title: name.to_owned(), axes, points: dots, front: false })
    })
}

/// Whether a point has a place on logarithmic axes.
fn positive(at: (f64, f64)) -> bool {
    [at.0, at.1].into_iter().all(|x| x > 0.0 && x.is_finite())
}

fn draw<B: DrawingBackend>(area: &DrawingArea<B, Shift>, panels: &[Panel], grid: (usize, usize)) -> Result<()> {
    let fill = || {
        area.fill(&WHITE)?;
        let (strip, area) = area.split_vertically(LEGEND);
        legend(&strip)?;
        area.split_evenly(grid).iter().zip(panels).try_for_each(|(area, panel)| diagram(area, panel))?;
        area.present()
    };
    fill().map_err(|e: DrawingAreaErrorKind<B::ErrorType>| Error::Device(format!("the plot cannot be drawn: {e}")))
}

fn legend<B: DrawingBackend>(
    strip: &DrawingArea<B, Shift>,
) -> std::result::Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    for (k, (engine, precision, color)) in SERIES.into_iter().enumerate() {
        let at = (76 + 120 * k as i32, 18);
        let name = Text::new(format!("{engine} {precision}"), (10, -8), (FONT, 15).into_font().color(&color));
        strip.draw(&(EmptyElement::at(at) + Circle::new((0, 0), 5, color.filled()) + name))?;
    }
    Ok(())
}

fn diagram<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
) -> std::result::Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let (x, y) = (decades(panel.points.iter().map(|d| d.at.0)), decades(panel.points.iter().map(|d| d.at.1)));
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, (FONT, 18))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    let exponent = |x: &f64| format!("{x:.0e}");
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(225, 225, 225))
        .label_style((FONT, 13))
        .axis_desc_style((FONT, 14))
        .x_labels(6)
        .y_labels(6)
        .x_label_formatter(&exponent)
        .y_label_formatter(&exponent)
        .x_desc(panel.axes.0)
        .y_desc(&panel.axes.1)
        .draw()?;
    if panel.front {
        let mut front: Vec<(f64, f64)> = panel.points.iter().filter(|d| d.point.pareto).map(|d| d.at).collect();
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        chart.draw_series(LineSeries::new(front, RGBColor(150, 150, 150).stroke_width(2)))?;
    }
    for (engine, precision, color) in SERIES {
        let of_series = |d: &&Dot| (d.point.engine, d.point.precision) == (engine, precision);
        let dots: Vec<&Dot> = panel.points.iter().filter(of_series).collect();
        if dots.is_empty() {
            continue;
        }
        let dot = |d: &&Dot| {
            EmptyElement::at(d.at)
                + Circle::new((0, 0), 4, color.filled())
                + Text::new(d.label.clone(), (6, -14), (FONT, 12).into_font().color(&color))
        };
        chart.draw_series(dots.iter().map(dot))?;
        if !panel.front {
            chart.draw_series(LineSeries::new(dots.iter().map(|d| d.at), color))?;
        }
    }
    Ok(())
}

/// Whole powers of ten around some numbers.
fn decades(numbers: impl Iterator<Item = f64> + Clone) -> Range<f64> {
    let low = numbers.clone().fold(f64::INFINITY, f64::min).log10();
    let high = numbers.fold(0.0, f64::max).log10();
    let (low, high) = ((low - 0.1).floor(), (high + 0.1).ceil());
    10.0_f64.powf(low)..10.0_f64.powf(high.max(low + 1.0))
}

#[cfg(test)]
mod tests {
    use super::decades;

    #[test]
    fn axes_end_at_powers_of_ten() {
        let range = decades([3e-4, 0.02].into_iter());
        assert!((range.start / 1e-4 - 1.0).abs() < 1e-12 && (range.end / 0.1 - 1.0).abs() < 1e-12);
        let single = decades([1e-7].into_iter());
        assert!(single.start < 1e-7 && 1e-7 < single.end);
    }
}
