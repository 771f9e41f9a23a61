//! Plots as SVG: lines, bars, points. The same bytes for the same numbers.

use plotters::prelude::*;

/// Colours that can be told apart, in print and by most eyes (Okabe and Ito).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(150, 150, 150),
];

const SIZE: (u32, u32) = (900, 480);

/// What stands at the axes.
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

fn colour(i: usize) -> RGBColor {
    COLOURS[i % COLOURS.len()]
}

/// Least and greatest of the finite values, with a little air; 0 to 1 of none.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    let air = 0.05 * (high - low).max(1e-9);
    (low - air, high + air)
}

/// Draws onto a new SVG; what a plot of finite numbers can't do is fail, so an error leaves an empty picture.
fn drawn(
    draw: impl FnOnce(
        &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    ) -> Result<(), Box<dyn std::error::Error>>,
) -> String {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        if area.fill(&WHITE).is_err() || draw(&area).is_err() || area.present().is_err() {
            return String::from("<svg xmlns=\"http://www.w3.org/2000/svg\"/>");
        }
    }
    svg
}

/// Lines, one a series.
pub fn lines(labels: Labels<'_>, series: &[Series]) -> String {
    let points = || series.iter().flat_map(|s| &s.1);
    let ((x0, x1), (y0, y1)) = (range(points().map(|p| p.0)), range(points().map(|p| p.1)));
    drawn(|area| {
        let mut chart = ChartBuilder::on(area)
            .caption(labels.title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(64)
            .build_cartesian_2d(x0..x1, y0..y1)?;
        chart.configure_mesh().x_desc(labels.x).y_desc(labels.y).light_line_style(WHITE).draw()?;
        for (i, (name, points)) in series.iter().enumerate() {
            let style = colour(i).stroke_width(2);
            let finite = points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
            chart
                .draw_series(LineSeries::new(finite, style))?
                .label(name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
        }
        chart
            .configure_series_labels()
            .border_style(BLACK.mix(0.3))
            .background_style(WHITE.mix(0.8))
            .draw()?;
        Ok(())
    })
}

/// Bars: one group a name, one bar a series in each. `values` has shape `[series][groups]`.
pub fn bars(labels: Labels<'_>, groups: &[String], series: &[(String, Vec<f64>)]) -> String {
    let high =
        series.iter().flat_map(|s| &s.1).copied().filter(|v| v.is_finite()).fold(1e-9, f64::max) * 1.08;
    drawn(|area| {
        let mut chart = ChartBuilder::on(area)
            .caption(labels.title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(64)
            .build_cartesian_2d(0.0..groups.len().max(1) as f64, 0.0..high)?;
        let name = |x: &f64| {
            if x.fract() == 0.0 {
                String::new()
            } else {
                groups.get(*x as usize).cloned().unwrap_or_default()
            }
        };
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(2 * groups.len() + 1)
            .x_label_formatter(&name)
            .x_desc(labels.x)
            .y_desc(labels.y)
            .light_line_style(WHITE)
            .draw()?;
        let width = 0.84 / series.len().max(1) as f64;
        for (i, (name, values)) in series.iter().enumerate() {
            let style = colour(i).filled();
            let left = 0.08 + width * i as f64;
            let bar = |(g, &v): (usize, &f64)| {
                let x = g as f64 + left;
                Rectangle::new([(x, 0.0), (x + 0.9 * width, v)], style)
            };
            let shown = values.iter().enumerate().filter(|(_, v)| v.is_finite());
            chart
                .draw_series(shown.map(bar))?
                .label(name)
                .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], style));
        }
        chart
            .configure_series_labels()
            .border_style(BLACK.mix(0.3))
            .background_style(WHITE.mix(0.8))
            .draw()?;
        Ok(())
    })
}

/// Named points.
pub fn points(labels: Labels<'_>, points: &[(String, f64, f64)]) -> String {
    let shown: Vec<&(String, f64, f64)> =
        points.iter().filter(|p| p.1.is_finite() && p.2.is_finite()).collect();
    let ((x0, x1), (y0, y1)) = (range(shown.iter().map(|p| p.1)), range(shown.iter().map(|p| p.2)));
    drawn(|area| {
        let mut chart = ChartBuilder::on(area)
            .caption(labels.title, ("sans-serif", 20))
            .margin(12)
            .right_y_label_area_size(90)
            .x_label_area_size(40)
            .y_label_area_size(64)
            .build_cartesian_2d(x0..x1, y0..y1)?;
        chart.configure_mesh().x_desc(labels.x).y_desc(labels.y).light_line_style(WHITE).draw()?;
        for (i, (name, x, y)) in shown.iter().map(|p| (&p.0, p.1, p.2)).enumerate() {
            chart.draw_series(std::iter::once(
                EmptyElement::at((x, y))
                    + Circle::new((0, 0), 4, colour(i).filled())
                    + Text::new(name.clone(), (7, -7), ("sans-serif", 13)),
            ))?;
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
        ] as [&dyn Fn() -> String; 4]
        {
            well_formed(&draw());
            assert_eq!(draw(), draw());
        }
    }
}
