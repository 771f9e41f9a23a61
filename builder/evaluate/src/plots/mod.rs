//! Plots as SVG: lines, bars, points. The same bytes for the same numbers.
//!
//! The legend is beside the plot, so that it covers nothing; the picture grows with it.

use std::ops::Range;

use gestus_motion::statistics::extent;
use plotters::{
    coord::{Shift, types::RangedCoordf64},
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

mod place;
pub mod poses;

/// Colours that are distinct in print and to most colour-blind readers; the first are those of Okabe and Ito.
const COLOURS: [RGBColor; 18] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(150, 150, 150),
    RGBColor(240, 228, 66),
    RGBColor(110, 50, 20),
    RGBColor(90, 40, 150),
    RGBColor(150, 210, 70),
    RGBColor(190, 15, 60),
    RGBColor(0, 75, 70),
    RGBColor(250, 175, 160),
    RGBColor(120, 130, 60),
    RGBColor(20, 30, 110),
    RGBColor(190, 170, 230),
];

/// Size of a plot without its legend and long axis names.
const SIZE: (u32, u32) = (820, 480);
/// Height for horizontal names under an axis, and mean width of a character in the fonts used.
const UNDER: u32 = 40;
const CHARACTER: f64 = 7.0;
/// Height of a line of the legend.
const LINE: u32 = 18;

/// Texts of a plot.
#[derive(Debug, Clone, Copy)]
pub struct Labels<'a> {
    /// Heading.
    pub title: &'a str,
    /// Under the horizontal axis.
    pub x: &'a str,
    /// Beside the vertical axis.
    pub y: &'a str,
}

/// A named series of points.
pub type Series = (String, Vec<(f64, f64)>);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;
type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Colours of a series. From the nineteenth on, a ring of another colour is around it.
fn colours(i: usize) -> (RGBColor, Option<RGBColor>) {
    let count = COLOURS.len();
    let ring = (i >= count).then(|| COLOURS[(i + i / count) % count]);
    (COLOURS[i % count], ring)
}

/// Range of the finite values with a margin; 0 to 1 where there are none. The range is wide enough that the labels of the
/// axis differ.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = extent(values.filter(|v| v.is_finite()));
    if low > high {
        return (0.0, 1.0);
    }
    let least = (0.02 * low.abs().max(high.abs())).max(1e-9);
    let (middle, span) = ((low + high) / 2.0, (high - low).max(least));
    (middle - 0.55 * span, middle + 0.55 * span)
}

fn width_of(text: &str) -> u32 {
    (CHARACTER * text.chars().count() as f64) as u32
}

/// Draws the legend's sample of a series at a place.
type Sample<'a> = &'a dyn Fn(&Area<'_>, usize, (i32, i32)) -> Drawn;

/// Names beside a plot, in as many columns as they need.
struct Legend {
    names: Vec<String>,
    column: u32,
    lines: usize,
}

impl Legend {
    fn new(names: Vec<String>, height: u32) -> Self {
        let column = 40 + names.iter().map(|n| width_of(n)).max().unwrap_or(0);
        Self { names, column, lines: ((height - 70) / LINE) as usize }
    }

    fn none() -> Self {
        Self { names: Vec::new(), column: 0, lines: 1 }
    }

    fn width(&self) -> u32 {
        self.names.len().div_ceil(self.lines) as u32 * self.column
    }

    fn draw(&self, area: &Area<'_>, sample: Sample<'_>) -> Drawn {
        let style = ("sans-serif", 13).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
        for (i, name) in self.names.iter().enumerate() {
            let x = 8 + (i / self.lines) as i32 * self.column as i32;
            let y = 52 + (i % self.lines) as i32 * LINE as i32;
            sample(area, i, (x, y))?;
            area.draw(&Text::new(name.clone(), (x + 26, y), style.clone()))?;
        }
        Ok(())
    }
}

/// Draws a picture without a legend.
fn drawn_alone(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Drawn) -> String {
    drawn(size, &Legend::none(), &|_, _, _| Ok(()), draw)
}

/// A chart with a heading and two axes; `under` is the height of the names below the horizontal one, pixels.
fn chart<'a, 'b>(
    area: &'b Area<'a>,
    title: &str,
    under: u32,
    x: Range<f64>,
    y: Range<f64>,
) -> Result<Chart<'a, 'b>, Box<dyn std::error::Error>> {
    let mut builder = ChartBuilder::on(area);
    builder.caption(title, ("sans-serif", 20)).margin(12).x_label_area_size(under).y_label_area_size(64);
    Ok(builder.build_cartesian_2d(x, y)?)
}

/// Draws a plot and its legend as SVG. Drawing finite numbers does not fail; an error gives an empty picture.
fn drawn(
    size: (u32, u32),
    legend: &Legend,
    sample: Sample<'_>,
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> String {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (size.0 + legend.width(), size.1)).into_drawing_area();
        let (plot, beside) = area.split_horizontally(size.0);
        if area.fill(&WHITE).is_err()
            || draw(&plot).is_err()
            || legend.draw(&beside, sample).is_err()
            || area.present().is_err()
        {
            return String::from("<svg xmlns=\"http://www.w3.org/2000/svg\"/>");
        }
    }
    svg
}

/// Lines, one a series.
pub fn lines(labels: Labels<'_>, series: &[Series]) -> String {
    let points = || series.iter().flat_map(|s| &s.1);
    let ((x0, x1), (y0, y1)) = (range(points().map(|p| p.0)), range(points().map(|p| p.1)));
    let legend = Legend::new(series.iter().map(|s| s.0.clone()).collect(), SIZE.1);
    let style = |i: usize| colours(i).0.stroke_width(2);
    let sample = |area: &Area<'_>, i: usize, (x, y): (i32, i32)| -> Drawn {
        Ok(area.draw(&PathElement::new(vec![(x, y), (x + 18, y)], style(i)))?)
    };
    drawn(SIZE, &legend, &sample, |area| {
        let mut chart = chart(area, labels.title, UNDER, x0..x1, y0..y1)?;
        chart.configure_mesh().x_desc(labels.x).y_desc(labels.y).light_line_style(WHITE).draw()?;
        for (i, (_, points)) in series.iter().enumerate() {
            let finite = points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
            chart.draw_series(LineSeries::new(finite, style(i)))?;
        }
        Ok(())
    })
}

/// Bars: one group a name, one bar a series in each. `values` has shape `[series][groups]`.
pub fn bars(labels: Labels<'_>, groups: &[String], series: &[(String, Vec<f64>)]) -> String {
    let high =
        series.iter().flat_map(|s| &s.1).copied().filter(|v| v.is_finite()).fold(1e-9, f64::max) * 1.08;
    let count = groups.len().max(1) as u32;
    let longest = groups.iter().map(|g| width_of(g)).max().unwrap_or(0);
    // Names that don't fit side by side stand on end, and need a line's width each.
    let size = (SIZE.0.max(100 + 16 * count), SIZE.1);
    let on_end = longest + 8 > (size.0 - 100) / count;
    let under = if on_end { UNDER + longest } else { UNDER };
    let size = (size.0, size.1 + under - UNDER);
    let legend = Legend::new(series.iter().map(|s| s.0.clone()).collect(), size.1);
    let sample = |area: &Area<'_>, i: usize, (x, y): (i32, i32)| -> Drawn {
        Ok(area.draw(&Rectangle::new([(x, y - 5), (x + 16, y + 5)], colours(i).0.filled()))?)
    };
    drawn(size, &legend, &sample, |area| {
        let mut chart = chart(area, labels.title, under, 0.0..f64::from(count), 0.0..high)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(0)
            .x_desc(labels.x)
            .y_desc(labels.y)
            .light_line_style(WHITE)
            .draw()?;
        let font = ("sans-serif", 12).into_font();
        let name = if on_end {
            font.transform(FontTransform::Rotate270).color(&BLACK).pos(Pos::new(HPos::Right, VPos::Center))
        } else {
            font.color(&BLACK).pos(Pos::new(HPos::Center, VPos::Top))
        };
        for (g, group) in groups.iter().enumerate() {
            let (x, y) = chart.backend_coord(&(g as f64 + 0.5, 0.0));
            area.draw(&Text::new(group.clone(), (x, y + 6), name.clone()))?;
        }
        let width = 0.84 / series.len().max(1) as f64;
        for (i, (_, values)) in series.iter().enumerate() {
            let left = 0.08 + width * i as f64;
            let bar = |(g, &v): (usize, &f64)| {
                let x = g as f64 + left;
                Rectangle::new([(x, 0.0), (x + 0.9 * width, v)], colours(i).0.filled())
            };
            let shown = values.iter().enumerate().filter(|(_, v)| v.is_finite());
            chart.draw_series(shown.map(bar))?;
        }
        Ok(())
    })
}

/// Named points: each has a number, and its name stands beside the plot.
pub fn points(labels: Labels<'_>, points: &[(String, f64, f64)]) -> String {
    let shown: Vec<&(String, f64, f64)> =
        points.iter().filter(|p| p.1.is_finite() && p.2.is_finite()).collect();
    let ((x0, x1), (y0, y1)) = (range(shown.iter().map(|p| p.1)), range(shown.iter().map(|p| p.2)));
    let names = shown.iter().enumerate().map(|(i, p)| format!("{}  {}", i + 1, p.0)).collect();
    let legend = Legend::new(names, SIZE.1);
    let dot = |area: &Area<'_>, i: usize, at: (i32, i32)| -> Drawn {
        let (own, ring) = colours(i);
        area.draw(&Circle::new(at, 5, own.filled()))?;
        if let Some(ring) = ring {
            area.draw(&Circle::new(at, 6, ring.stroke_width(2)))?;
        }
        Ok(())
    };
    let sample = |area: &Area<'_>, i: usize, (x, y): (i32, i32)| dot(area, i, (x + 10, y));
    drawn(SIZE, &legend, &sample, |area| {
        let mut chart = chart(area, labels.title, UNDER, x0..x1, y0..y1)?;
        chart.configure_mesh().x_desc(labels.x).y_desc(labels.y).light_line_style(WHITE).draw()?;
        let at: Vec<(i32, i32)> = shown.iter().map(|p| chart.backend_coord(&(p.1, p.2))).collect();
        let (across, down) = chart.plotting_area().get_pixel_range();
        let style = ("sans-serif", 12).into_font().color(&BLACK).pos(Pos::new(HPos::Center, VPos::Center));
        let places = place::labels(&at, across, down);
        for (&point, &label) in at.iter().zip(&places) {
            area.draw(&PathElement::new(vec![point, label], BLACK.mix(0.35)))?;
        }
        for (i, (&point, label)) in at.iter().zip(places).enumerate() {
            dot(area, i, point)?;
            let (x, y) = label;
            let half = place::WIDE / 2;
            area.draw(&Rectangle::new([(x - half, y - 6), (x + half, y + 6)], WHITE.filled()))?;
            area.draw(&Text::new((i + 1).to_string(), label, style.clone()))?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABELS: Labels<'_> = Labels { title: "a < b", x: "x", y: "y" };

    fn well_formed(svg: &str) {
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{}",
            &svg[..80.min(svg.len())]
        );
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn every_plot_is_a_picture_and_the_same_twice() {
        let series = vec![("one".to_owned(), vec![(0.0, 1.0), (1.0, 3.0), (2.0, f64::NAN)])];
        let bar = vec![("one".to_owned(), vec![1.0, 2.0]), ("two".to_owned(), vec![0.5, f64::NAN])];
        let groups = ["walk".to_owned(), "run".to_owned()];
        for draw in [
            &|| lines(LABELS, &series) as String,
            &|| bars(LABELS, &groups, &bar),
            &|| points(LABELS, &[("p".to_owned(), 1.0, 2.0)]),
            &|| lines(LABELS, &[]),
            &|| bars(LABELS, &[], &[]),
            &|| points(LABELS, &[]),
        ] as [&dyn Fn() -> String; 6]
        {
            well_formed(&draw());
            assert_eq!(draw(), draw());
        }
    }

    #[test]
    fn no_two_series_look_alike() {
        let looks: Vec<_> = (0..100).map(colours).collect();
        for (i, look) in looks.iter().enumerate() {
            assert!(!looks[..i].contains(look), "series {i}");
        }
    }

    #[test]
    fn marks_of_an_axis_differ_where_values_hardly_do() {
        let (low, high) = range([1.0, 1.0 - 1e-12].into_iter());
        assert!(low < 0.995 && high > 1.005, "{low} {high}");
        assert_eq!(range([0.0, 10.0].into_iter()), (-0.5, 10.5));
    }
}
