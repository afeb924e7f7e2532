//! One picture per suite, as SVG and PNG: error over wall time per simulated second, speed over size, or residual over
//! wall time.

use super::results::{Bench, Point, ResidualRow, Suite};
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
/// Panels side by side.
const COLUMNS: usize = 3;
/// Pixels of the strip above them that tells which series looks how: left margin, height of a row, and what is above
/// and below.
const LEGEND_LEFT: u32 = 76;
const LEGEND_ROW: u32 = 20;
const LEGEND_MARGIN: u32 = 12;
const FONT: &str = "sans-serif";

// Colours that colour-blind eyes tell apart (Okabe and Ito).
const INDIGO: RGBColor = RGBColor(0, 114, 178);
const VERMILION: RGBColor = RGBColor(213, 94, 0);
const TEAL: RGBColor = RGBColor(0, 158, 115);
const ORANGE: RGBColor = RGBColor(230, 159, 0);
const SKY: RGBColor = RGBColor(86, 180, 233);
const PURPLE: RGBColor = RGBColor(204, 121, 167);
const GREY: RGBColor = RGBColor(150, 150, 150);

/// Engines with the colours they have wherever they are compared.
const ENGINES: [(&str, &str, RGBColor); 3] =
    [("cpu", "double", INDIGO), ("gpu", "single", VERMILION), ("gpu", "double", TEAL)];

/// Solvers with theirs; the rest is black.
const SOLVERS: [(&str, RGBColor); 7] = [
    ("gauss-seidel shuffled-once", GREY),
    ("gauss-seidel random-sweep", TEAL),
    ("gauss-seidel random-sequential", ORANGE),
    ("jacobi", PURPLE),
    ("jacobi-accelerated", INDIGO),
    ("coloured-accelerated", VERMILION),
    ("socp", SKY),
];

/// What belongs together in all panels, and how it looks.
struct Series {
    name: String,
    color: RGBColor,
    look: Look,
}

#[derive(Clone, Copy, PartialEq)]
enum Look {
    Dots,
    JoinedDots,
    Line,
    Dashes,
}

/// A diagram.
struct Panel {
    title: String,
    axes: (&'static str, String),
    /// Of every series of the picture.
    dots: Vec<Vec<Dot>>,
    /// The Pareto front.
    front: Vec<(f64, f64)>,
}

struct Dot {
    at: (f64, f64),
    label: String,
}

/// What a panel of curves has.
pub struct Curves {
    pub title: String,
    pub axes: (&'static str, String),
    /// Of every series of the picture.
    pub points: Vec<Vec<(f64, f64)>>,
}

/// What there is to draw of a suite.
pub struct Picture {
    series: Vec<Series>,
    panels: Vec<Panel>,
}

impl Picture {
    /// None: nothing that has a place on logarithmic axes.
    pub fn of(suite: Suite, bench: &Bench) -> Option<Picture> {
        let points: Vec<&Point> = bench.points.iter().filter(|p| p.suite == suite).collect();
        let picture = match suite {
            Suite::Speed => Picture { series: engines(Look::JoinedDots), panels: speeds(&points) },
            Suite::Relaxation => residuals(&bench.residuals),
            Suite::Precision => return None,
            _ => Picture { series: engines(Look::Dots), panels: errors(&points) },
        };
        (!picture.panels.is_empty()).then_some(picture)
    }

    /// Joined points of some series, by the names of all: a title, axes and a list of points for each of them.
    pub fn of_curves(names: &[&str], curves: Vec<Curves>) -> Picture {
        let colors = [INDIGO, VERMILION, TEAL, ORANGE, SKY, PURPLE].into_iter().cycle();
        let series = names.iter().zip(colors);
        let series =
            series.map(|(name, color)| Series { name: (*name).to_owned(), color, look: Look::JoinedDots }).collect();
        let panel = |Curves { title, axes, points }| {
            let dot = |at| Some(Dot { at: positive(at)?, label: String::new() });
            let dots = points.into_iter().map(|of| of.into_iter().filter_map(dot).collect());
            Panel { title, axes, dots: dots.collect(), front: Vec::new() }
        };
        let panels: Vec<Panel> = curves.into_iter().map(panel).collect();
        Picture { series, panels: panels.into_iter().filter(|p| p.dots.iter().any(|of| !of.is_empty())).collect() }
    }

    /// Rows and columns of panels, and pixels of it all.
    fn size(&self) -> ((usize, usize), (u32, u32)) {
        let columns = self.panels.len().clamp(1, COLUMNS);
        let rows = self.panels.len().div_ceil(columns);
        let width = WIDTH * columns as u32;
        ((rows, columns), (width, self.legend_rows(width) * LEGEND_ROW + LEGEND_MARGIN + HEIGHT * rows as u32))
    }

    /// Draw it as SVG.
    ///
    /// # Errors
    /// [`Error::Device`] if it cannot be drawn.
    pub fn svg(&self) -> Result<String> {
        embed_font();
        let (grid, size) = self.size();
        let mut svg = String::new();
        self.draw(&SVGBackend::with_string(&mut svg, size).into_drawing_area(), grid)?;
        Ok(svg)
    }

    /// Draw it to `NAME.svg` and `NAME.png`.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be written.
    pub fn write(&self, folder: &Path, name: &str) -> Result<()> {
        let svg = self.svg()?;
        let (grid, size) = self.size();
        let path = folder.join(format!("{name}.svg"));
        replace(&path, |part| std::fs::write(part, &svg).map_err(at(part)))?;

        let mut pixels = vec![0; (3 * size.0 * size.1) as usize];
        self.draw(&BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area(), grid)?;
        let path = folder.join(format!("{name}.png"));
        replace(&path, |part| {
            let mut encoder = png::Encoder::new(BufWriter::new(File::create(part).map_err(at(part))?), size.0, size.1);
            encoder.set_color(png::ColorType::Rgb);
            let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels));
            written.map_err(|e| at(part)(std::io::Error::other(e)))
        })
    }

    /// Pixels of a name in the legend, and names in a row of it.
    fn legend_columns(&self, width: u32) -> (u32, u32) {
        let longest = self.series.iter().map(|s| s.name.len() as u32).max().unwrap_or(0);
        let cell = 50 + 7 * longest;
        (cell, ((width - LEGEND_LEFT) / cell).max(1))
    }

    fn legend_rows(&self, width: u32) -> u32 {
        (self.series.len() as u32).div_ceil(self.legend_columns(width).1)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, grid: (usize, usize)) -> Result<()> {
        let fill = || {
            area.fill(&WHITE)?;
            let width = area.dim_in_pixel().0;
            let (strip, area) = area.split_vertically(self.legend_rows(width) * LEGEND_ROW + LEGEND_MARGIN);
            self.legend(&strip)?;
            let areas = area.split_evenly(grid);
            areas.iter().zip(&self.panels).try_for_each(|(area, panel)| self.diagram(area, panel))?;
            area.present()
        };
        fill().map_err(|e: DrawingAreaErrorKind<B::ErrorType>| Error::Device(format!("the plot cannot be drawn: {e}")))
    }

    fn legend<B: DrawingBackend>(&self, strip: &DrawingArea<B, Shift>) -> Drawn<B> {
        let (cell, columns) = self.legend_columns(strip.dim_in_pixel().0);
        for (k, Series { name, color, look }) in self.series.iter().enumerate() {
            let (column, row) = (k as u32 % columns, k as u32 / columns);
            let at = ((LEGEND_LEFT + cell * column) as i32, (18 + LEGEND_ROW * row) as i32);
            let here = || EmptyElement::at(at);
            let stroke = color.stroke_width(2);
            strip.draw(&(here() + Text::new(name.clone(), (10, -8), (FONT, 15).into_font().color(color))))?;
            match look {
                Look::Dots | Look::JoinedDots => strip.draw(&(here() + Circle::new((0, 0), 5, color.filled())))?,
                Look::Line => strip.draw(&(here() + PathElement::new([(-22, 0), (4, 0)], stroke)))?,
                Look::Dashes => {
                    let dash = |from: i32| PathElement::new([(from, 0), (from + 6, 0)], stroke);
                    strip.draw(&(here() + dash(-22) + dash(-12) + dash(-2)))?;
                }
            }
        }
        Ok(())
    }

    fn diagram<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, panel: &Panel) -> Drawn<B> {
        let all = || panel.dots.iter().flatten().map(|d| d.at);
        let (x, y) = (decades(all().map(|at| at.0)), decades(all().map(|at| at.1)));
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
        chart.draw_series(LineSeries::new(panel.front.iter().copied(), GREY.stroke_width(2)))?;
        for (Series { color, look, .. }, dots) in self.series.iter().zip(&panel.dots) {
            let line = || dots.iter().map(|d| d.at);
            if matches!(look, Look::Dots | Look::JoinedDots) {
                let dot = |d: &Dot| {
                    EmptyElement::at(d.at)
                        + Circle::new((0, 0), 4, color.filled())
                        + Text::new(d.label.clone(), (6, -14), (FONT, 12).into_font().color(color))
                };
                chart.draw_series(dots.iter().map(dot))?;
            }
            match look {
                Look::Dots => {}
                Look::JoinedDots => drop(chart.draw_series(LineSeries::new(line(), color))?),
                Look::Line => drop(chart.draw_series(LineSeries::new(line(), color.stroke_width(2)))?),
                Look::Dashes => drop(chart.draw_series(DashedLineSeries::new(line(), 6, 4, color.stroke_width(2)))?),
            }
        }
        Ok(())
    }
}

type Drawn<B> = std::result::Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Text is drawn with a font of our own, so that pictures look the same on machines without any.
fn embed_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let known = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
        assert!(known.is_ok(), "the embedded font is a font");
    });
}

fn engines(look: Look) -> Vec<Series> {
    let series = |(engine, precision, color)| Series { name: format!("{engine} {precision}"), color, look };
    ENGINES.map(series).into()
}

/// The points of every engine where `dot` places them.
fn by_engine(points: &[&Point], dot: impl Fn(&Point) -> Option<Dot>) -> Vec<Vec<Dot>> {
    let of = |(engine, precision, _)| {
        let same = points.iter().filter(|p| (p.engine, p.precision) == (engine, precision));
        same.filter_map(|p| dot(p)).collect()
    };
    ENGINES.map(of).into()
}

/// One panel per case and quantity with at least one positive error.
fn errors(points: &[&Point]) -> Vec<Panel> {
    let mut groups = Vec::new();
    for group in points.iter().filter(|p| p.error.is_some()).map(|p| (p.case.as_str(), p.quantity)) {
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    let panel = |(case, quantity): (&str, &str)| {
        let same: Vec<&Point> =
            points.iter().filter(|p| (p.case.as_str(), p.quantity) == (case, quantity)).copied().collect();
        let place = |point: &Point| positive((point.wall_per_simulated?, point.error?));
        let dot = |point: &Point| Some(Dot { at: place(point)?, label: format!("×{}", point.dt_over_auto) });
        let dots = by_engine(&same, dot);
        let unit = same.iter().find(|p| place(p).is_some())?.unit;
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        let mut front: Vec<(f64, f64)> = same.iter().filter(|p| p.pareto).filter_map(|p| place(p)).collect();
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        let axes = ("wall seconds per simulated second", format!("error{unit}"));
        Some(Panel { title: format!("{case}: {quantity}"), axes, dots, front })
    };
    groups.into_iter().filter_map(panel).collect()
}

/// One panel per scene.
fn speeds(points: &[&Point]) -> Vec<Panel> {
    let scene = |p: &Point| p.case.split(' ').next().unwrap_or("").to_owned();
    let names: BTreeSet<String> = points.iter().map(|p| scene(p)).collect();
    let panel = |name: String| {
        let same: Vec<&Point> = points.iter().filter(|p| scene(p) == name).copied().collect();
        let dot = |point: &Point| {
            let at = positive((point.grains? as f64, point.particle_steps_per_second?))?;
            Some(Dot { at, label: String::new() })
        };
        let dots = by_engine(&same, dot);
        let axes = ("grains", "particle-steps per second".to_owned());
        dots.iter().any(|d| !d.is_empty()).then(|| Panel { title: name, axes, dots, front: Vec::new() })
    };
    names.into_iter().rev().filter_map(panel).collect()
}

/// One panel per bed, one line per solver and engine.
fn residuals(rows: &[ResidualRow]) -> Picture {
    let (mut cases, mut keys) = (Vec::new(), Vec::new());
    for row in rows {
        let key = (row.solver.as_str(), row.engine);
        if !cases.contains(&row.case.as_str()) {
            cases.push(&row.case);
        }
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let series = |&(solver, engine): &(&str, &str)| Series {
        name: format!("{solver}, {engine}"),
        color: SOLVERS.iter().find(|(name, _)| *name == solver).map_or(BLACK, |(_, color)| *color),
        look: if engine == "gpu" { Look::Dashes } else { Look::Line },
    };
    let panel = |case: &&str| {
        let of = |key: &(&str, &str)| {
            let own = rows.iter().filter(|row| row.case == **case && (row.solver.as_str(), row.engine) == *key);
            own.filter_map(|row| Some(Dot { at: positive((row.seconds, row.residual))?, label: String::new() }))
                .collect()
        };
        let axes = ("wall seconds", "relative residual".to_owned());
        Panel { title: (*case).to_owned(), axes, dots: keys.iter().map(of).collect(), front: Vec::new() }
    };
    Picture { series: keys.iter().map(series).collect(), panels: cases.iter().map(panel).collect() }
}

/// A point that has a place on logarithmic axes.
fn positive(at: (f64, f64)) -> Option<(f64, f64)> {
    [at.0, at.1].into_iter().all(|x| x > 0.0 && x.is_finite()).then_some(at)
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
