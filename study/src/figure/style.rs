//! What all figures have in common: fonts, inks, axes, legends beside the drawing, subscripts.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

use super::DrawError;

/// Drawing area of every figure.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A chart in the plane.
pub(super) type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;

const FONT: &str = "sans-serif";
/// Sizes of letters, pixels: title, what stands on an axis, marks of an axis and legend.
const TITLE: u32 = 17;
const NAME: u32 = 15;
const LABEL: u32 = 13;
/// Pixels from line to line of a legend.
const LINE: u32 = 20;

/// Told apart in print and by colour-blind readers as well (Okabe and Ito's palette).
pub(super) const INKS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

/// Symbols with a subscript, as texts have them: `I_T` is set as I with a small T below.
const SYMBOLS: [&str; 4] = ["I_3L", "I_L", "I_T", "L_A"];

/// Draws a figure of this size.
pub(super) fn figure(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), DrawError>,
) -> Result<String, DrawError> {
    layer(size, |root| {
        root.fill(&WHITE)?;
        draw(root)
    })
}

/// The same without white paper: to be laid over a picture.
pub(super) fn layer(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), DrawError>,
) -> Result<String, DrawError> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&root)?;
        root.present()?;
    }
    Ok(with_subscripts(&svg))
}

/// A chart with room for its axes.
pub(super) fn builder<'a, 'b>(area: &'a Area<'b>, title: &str) -> ChartBuilder<'a, 'b, SVGBackend<'b>> {
    let mut builder = ChartBuilder::on(area);
    // An empty caption would take room as well.
    if !title.is_empty() {
        builder.caption(title, (FONT, TITLE));
    }
    builder.margin(12).x_label_area_size(46).y_label_area_size(60);
    builder
}

/// Writes a title at a place of its own, for charts that leave no room for theirs.
pub(super) fn title(area: &Area<'_>, words: &str, at: (i32, i32)) -> Result<(), DrawError> {
    area.draw_text(words, &TextStyle::from((FONT, TITLE).into_font()).pos(text_anchor(false)), at)?;
    Ok(())
}

/// Writes a label with its middle, or its left end, at a place.
pub(super) fn label(area: &Area<'_>, words: &str, at: (i32, i32), middle: bool) -> Result<(), DrawError> {
    area.draw_text(words, &TextStyle::from((FONT, LABEL).into_font()).pos(text_anchor(middle)), at)?;
    Ok(())
}

/// Draws the axes, all figures' alike.
pub(super) fn axes<X, Y>(chart: &mut Chart<'_, '_, X, Y>, x: &str, y: &str) -> Result<(), DrawError>
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.1))
        .x_desc(x)
        .y_desc(y)
        .x_label_formatter(&mark_of)
        .y_label_formatter(&mark_of)
        .label_style((FONT, LABEL))
        .axis_desc_style((FONT, NAME))
        .draw()?;
    Ok(())
}

/// The same where the places along X are categories: lines and numbers stand at Y alone, and every category has its name below its place.
pub(super) fn axes_of_categories<X, Y>(
    chart: &mut Chart<'_, '_, X, Y>,
    names: &[(String, f64)],
    y: &str,
    foot: f64,
) -> Result<(), DrawError>
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.1))
        .x_labels(0)
        .y_desc(y)
        .y_label_formatter(&mark_of)
        .label_style((FONT, LABEL))
        .axis_desc_style((FONT, NAME))
        .draw()?;
    let root = chart.plotting_area().strip_coord_spec();
    let (left, top) = root.get_base_pixel();
    let below = TextStyle::from((FONT, LABEL - 1).into_font()).pos(text_anchor(true));
    for (name, place) in names {
        let (x, y) = chart.backend_coord(&(*place, foot));
        for (line, words) in name.split_whitespace().enumerate() {
            let at = (x - left, y - top + 6 + 13 * line as i32);
            root.draw_text(words, &below, at)?;
        }
    }
    Ok(())
}

fn text_anchor(middle: bool) -> plotters::style::text_anchor::Pos {
    use plotters::style::text_anchor::{HPos, Pos, VPos};
    if middle { Pos::new(HPos::Center, VPos::Top) } else { Pos::new(HPos::Left, VPos::Center) }
}

/// What a line of a legend shows before its text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mark {
    Dashes,
    Band,
    Disc,
    Ring,
    Triangle,
    Cross,
}

impl Mark {
    /// The mark as a point of a chart or of a legend.
    pub(super) fn at<B: DrawingBackend, C: Clone + 'static>(
        self,
        at: C,
        ink: RGBColor,
    ) -> DynElement<'static, B, C> {
        match self {
            Self::Ring => Circle::new(at, 4, ink.stroke_width(1)).into_dyn(),
            Self::Triangle => TriangleMarker::new(at, 5, ink.filled()).into_dyn(),
            Self::Cross => Cross::new(at, 4, ink.stroke_width(2)).into_dyn(),
            Self::Disc | Self::Dashes | Self::Band => Circle::new(at, 4, ink.filled()).into_dyn(),
        }
    }
}

/// A line of a legend.
#[derive(Clone, Debug)]
pub(super) struct Key {
    pub(super) mark: Mark,
    pub(super) ink: RGBColor,
    pub(super) text: String,
}

impl Key {
    pub(super) fn new(mark: Mark, ink: RGBColor, text: impl Into<String>) -> Self {
        Self { mark, ink, text: text.into() }
    }
}

/// Height of a legend of so many lines, pixels.
pub(super) fn legend_height(keys: usize) -> u32 {
    LINE * keys as u32 + 12
}

/// Draws a legend in an area of its own, below the chart, where it covers nothing; `left` pixels from its edge.
pub(super) fn legend(area: &Area<'_>, left: i32, keys: &[Key]) -> Result<(), DrawError> {
    let style = TextStyle::from((FONT, LABEL).into_font()).pos(text_anchor(false));
    for (line, Key { mark, ink, text }) in keys.iter().enumerate() {
        let y = LINE as i32 * line as i32 + LINE as i32 / 2;
        let stroke = |from, to, width| {
            PathElement::new(vec![(left + from, y), (left + to, y)], ink.stroke_width(width))
        };
        match mark {
            Mark::Dashes => {
                for dash in 0..3 {
                    area.draw(&stroke(10 * dash, 10 * dash + 6, 1))?;
                }
            }
            Mark::Band => {
                area.draw(&Rectangle::new([(left, y - 6), (left + 28, y + 6)], ink.mix(BAND).filled()))?;
            }
            point => area.draw(&point.at((left + 14, y), *ink))?,
        }
        area.draw_text(text, &style, (left + 38, y))?;
    }
    Ok(())
}

/// How strongly a confidence band is inked.
pub(super) const BAND: f64 = 0.16;

/// A band between two paths.
pub(super) fn band(low: &[(f64, f64)], high: &[(f64, f64)], ink: RGBColor) -> Polygon<(f64, f64)> {
    let outline: Vec<(f64, f64)> = low.iter().chain(high.iter().rev()).copied().collect();
    Polygon::new(outline, ink.mix(BAND).filled())
}

/// Sets the symbols of all texts with subscripts.
fn with_subscripts(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut rest = svg;
    while let Some(end) = rest.find("</text>") {
        let (before, after) = rest.split_at(end);
        let begin = before.rfind('>').map_or(0, |at| at + 1);
        let (tags, words) = before.split_at(begin);
        out.push_str(tags);
        out.push_str(&set(words));
        let (close, after) = after.split_at("</text>".len());
        out.push_str(close);
        rest = after;
    }
    out.push_str(rest);
    out
}

/// A text with its symbols in spans: shifts are relative, so what follows a subscript is raised again. A space beside a span is a shift, too,
/// for some programs drop it.
fn set(words: &str) -> String {
    let mut out = String::new();
    let mut rest = words.trim();
    let mut raise = "";
    while let Some((at, symbol)) =
        SYMBOLS.iter().filter_map(|symbol| Some((rest.find(symbol)?, *symbol))).min()
    {
        let (before, after) = rest.split_at(at);
        let (letter, below) = symbol.split_once('_').unwrap_or((symbol, ""));
        out.push_str(&span(raise, before));
        let raise_letter = if before.trim().is_empty() { raise } else { "" };
        let away = shift(before.ends_with(' '));
        out.push_str(&format!("<tspan{raise_letter}{away} font-style=\"italic\">{letter}</tspan>"));
        out.push_str(&format!("<tspan dy=\"0.36em\" font-size=\"70%\">{below}</tspan>"));
        rest = after.strip_prefix(symbol).unwrap_or_default();
        raise = " dy=\"-0.25em\"";
    }
    if out.is_empty() {
        return words.to_owned();
    }
    out.push_str(&span(raise, rest));
    out
}

/// Words between two symbols, if there are any.
fn span(raise: &str, words: &str) -> String {
    let (shifted, words) = (shift(words.starts_with(' ')), words.trim());
    if words.is_empty() { String::new() } else { format!("<tspan{raise}{shifted}>{words}</tspan>") }
}

/// The width of a space.
fn shift(there: bool) -> &'static str {
    if there { " dx=\"0.28em\"" } else { "" }
}

/// A number on an axis: as few digits as tell it.
fn mark_of(value: &f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded == 0.0 { "0".to_owned() } else { rounded.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_of_an_axis_have_no_empty_digits() {
        assert_eq!(
            [10.0, 0.30000000000000004, 2.5, -0.0].map(|value| mark_of(&value)),
            ["10", "0.3", "2.5", "0"]
        );
    }

    #[test]
    fn symbols_are_set_with_subscripts_and_nothing_else_is_touched() {
        assert_eq!(set("advance, mm"), "advance, mm");
        let one = set("leaf area L_A, m²");
        assert_eq!(
            one,
            "<tspan>leaf area</tspan><tspan dx=\"0.28em\" font-style=\"italic\">L</tspan><tspan dy=\"0.36em\" font-size=\"70%\">A</tspan><tspan dy=\"-0.25em\">, m²</tspan>"
        );
        assert!(set("\nI_T of\n").ends_with("<tspan dy=\"-0.25em\" dx=\"0.28em\">of</tspan>"));
        // Of two symbols side by side the second one is raised again.
        assert!(
            set("I_T I_L").contains("<tspan dy=\"-0.25em\" dx=\"0.28em\" font-style=\"italic\">I</tspan>")
        );
        assert_eq!(set("L_A = 3 I_3L").matches("italic").count(), 2);
        assert!(!set("L_A = 3 I_3L − 1").contains('_'));
        let svg = "<text x=\"1\">\nI_T\n</text><rect id=\"I_T\"/><text>b</text>";
        let found = with_subscripts(svg);
        assert!(
            found.contains(">T</tspan>") && found.contains("id=\"I_T\"") && found.ends_with("<text>b</text>")
        );
    }
}
