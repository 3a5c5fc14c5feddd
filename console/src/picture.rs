//! Charts: speed, functions and paths over time, as SVG and PNG with the same content.

use std::{fs, io, path::Path, sync::Arc};

use plotters::coord::Shift;
use plotters::prelude::*;
use resvg::{tiny_skia, usvg};

const SIZE: (u32, u32) = (1_200, 820);
const FONT: &str = "Ubuntu";

/// A line over time.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Shown in the legend.
    pub name: &'static str,
    /// Colour.
    pub colour: RGBColor,
    /// Time s, value.
    pub points: Vec<(f64, f64)>,
}

/// A state that is on for some spans of time.
#[derive(Debug, Clone)]
pub struct Lane {
    /// Shown at the left.
    pub name: &'static str,
    /// Colour while on.
    pub colour: RGBColor,
    /// Start and end, s.
    pub spans: Vec<(f64, f64)>,
}

/// Everything one chart shows.
#[derive(Debug, Clone)]
pub struct Chart {
    /// Headline.
    pub title: String,
    /// Start and end, s.
    pub time: (f64, f64),
    /// Lowest and highest speed shown, rpm.
    pub speed: (f64, f64),
    /// Time s, lower and upper limit, rpm: what the functions permit.
    pub envelope: Vec<(f64, f64, f64)>,
    /// Speeds.
    pub curves: Vec<Curve>,
    /// States.
    pub lanes: Vec<Lane>,
    /// Instants with a number that the timeline explains.
    pub marks: Vec<(f64, String)>,
}

/// Writes `chart` as `stem.svg` and `stem.png`.
///
/// # Errors
/// When a file cannot be written or the drawing fails.
pub fn write(chart: &Chart, stem: &Path) -> io::Result<()> {
    let svg = draw(chart).map_err(|error| io::Error::other(error.to_string()))?;
    fs::write(stem.with_extension("svg"), &svg)?;
    fs::write(stem.with_extension("png"), png(&svg)?)
}

fn draw(chart: &Chart) -> Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.titled(&chart.title, (FONT, 22))?;
        let (top, bottom) = root.split_vertically(470);
        speeds(chart, &top)?;
        lanes(chart, &bottom)?;
        root.present()?;
    }
    Ok(svg)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn speeds(chart: &Chart, area: &Area<'_>) -> Result<(), Box<dyn std::error::Error>> {
    let mut plot = ChartBuilder::on(area)
        .margin(8)
        .x_label_area_size(28)
        .y_label_area_size(150)
        .build_cartesian_2d(chart.time.0..chart.time.1, chart.speed.0..chart.speed.1)?;
    plot.configure_mesh()
        .light_line_style(WHITE.mix(0.0))
        .bold_line_style(BLACK.mix(0.12))
        .y_desc("speed, rpm")
        .label_style((FONT, 14))
        .draw()?;
    let clamp = |value: f64| value.clamp(chart.speed.0, chart.speed.1);
    let upper = chart.envelope.iter().map(|(t, _, high)| (*t, clamp(*high)));
    let lower = chart.envelope.iter().rev().map(|(t, low, _)| (*t, clamp(*low)));
    let shape: Vec<_> = upper.clone().chain(lower).collect();
    let green = RGBColor(46, 139, 87);
    plot.draw_series(std::iter::once(Polygon::new(shape, green.mix(0.14))))?
        .label("permitted")
        .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 18, y + 5)], green.mix(0.3).filled()));
    plot.draw_series(LineSeries::new(upper, green.mix(0.8)))?;
    for curve in &chart.curves {
        let colour = curve.colour;
        plot.draw_series(LineSeries::new(curve.points.iter().copied(), colour.stroke_width(2)))?
            .label(curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    let height = chart.speed.1 - chart.speed.0;
    for (index, (time, text)) in chart.marks.iter().enumerate() {
        plot.draw_series(LineSeries::new([(*time, chart.speed.0), (*time, chart.speed.1)], BLACK.mix(0.35)))?;
        let place = (*time, chart.speed.1 - height * (0.01 + 0.035 * (index % 3) as f64));
        plot.draw_series(std::iter::once(Text::new(text.clone(), place, (FONT, 15).into_font())))?;
    }
    plot.configure_series_labels()
        .label_font((FONT, 14))
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.2))
        .position(SeriesLabelPosition::LowerLeft)
        .draw()?;
    Ok(())
}

fn lanes(chart: &Chart, area: &Area<'_>) -> Result<(), Box<dyn std::error::Error>> {
    let count = chart.lanes.len();
    let mut plot = ChartBuilder::on(area)
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(150)
        .build_cartesian_2d(chart.time.0..chart.time.1, 0.0..count as f64)?;
    plot.configure_mesh()
        .disable_y_mesh()
        .light_line_style(WHITE.mix(0.0))
        .bold_line_style(BLACK.mix(0.12))
        .x_desc("time, s")
        .y_label_formatter(&|_| String::new())
        .label_style((FONT, 14))
        .draw()?;
    for (row, lane) in chart.lanes.iter().enumerate() {
        let base = (count - 1 - row) as f64;
        let band = |span: &(f64, f64)| {
            Rectangle::new([(span.0, base + 0.2), (span.1, base + 0.8)], lane.colour.filled())
        };
        plot.draw_series(lane.spans.iter().map(band))?;
        let (x, y) = plot.backend_coord(&(chart.time.0, base + 0.5));
        let (left, top) = area.get_base_pixel();
        let label = Text::new(lane.name, (x - left - 140, y - top - 8), (FONT, 15).into_font());
        area.draw(&label)?;
    }
    Ok(())
}

fn png(svg: &str) -> io::Result<Vec<u8>> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    let known = fonts.faces().next().and_then(|face| face.families.first()).map(|(name, _)| name.clone());
    let options = usvg::Options {
        fontdb: Arc::new(fonts),
        font_family: known.unwrap_or_default(),
        ..usvg::Options::default()
    };
    let tree = usvg::Tree::from_str(svg, &options).map_err(io::Error::other)?;
    let mut pixels = tiny_skia::Pixmap::new(SIZE.0, SIZE.1).ok_or_else(|| io::Error::other("no memory"))?;
    resvg::render(&tree, tiny_skia::Transform::identity(), &mut pixels.as_mut());
    pixels.encode_png().map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_becomes_an_svg_with_its_text_and_a_png_of_the_same_size() {
        let chart = Chart {
            title: "an axis".into(),
            time: (0.0, 2.0),
            speed: (-100.0, 1_000.0),
            envelope: vec![(0.0, -900.0, 900.0), (2.0, -500.0, 500.0)],
            curves: vec![Curve { name: "channel A", colour: BLUE, points: vec![(0.0, 0.0), (2.0, 400.0)] }],
            lanes: vec![Lane { name: "STO", colour: RED, spans: vec![(0.5, 1.0)] }],
            marks: vec![(0.5, "1".into())],
        };
        let svg = draw(&chart).expect("drawn");
        for text in ["an axis", "channel A", "STO", "permitted"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        let png = png(&svg).expect("rendered");
        assert_eq!(png[16..24], [0, 0, 4, 176, 0, 0, 3, 52], "1,200 x 820 pixels");
    }
}
