//! Letters: a strip of greyscale glyphs (`font.png`: DejaVu Sans at 32 px, licence beside it), scaled to any size.

use super::colour::Rgb;
use super::image::Image;
use std::sync::LazyLock;

/// Glyphs of the strip, in order.
const GLYPHS: &str = concat!(
    " !\"#$%&'()*+,-./0123456789:;<=>?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_`abcdefghijklmnopqrstuvwxyz{|}~",
    "°µ·²³±−×γεσθ–"
);

/// Width of every glyph, px at the size of the strip; in the strip each glyph has a margin of [`MARGIN`] on both sides.
const WIDTHS: [u8; 108] = [
    11, 13, 15, 27, 21, 31, 25, 9, 13, 13, 16, 27, 11, 12, 11, 11, 21, 21, 21, 21, 21, 21, 21, 21, 21, 21, 11, 11, 27,
    27, 27, 17, 32, 22, 22, 23, 25, 21, 19, 25, 25, 10, 10, 21, 18, 28, 24, 26, 20, 26, 23, 21, 20, 24, 22, 32, 22, 20,
    22, 13, 11, 13, 27, 16, 16, 20, 21, 18, 21, 20, 12, 21, 21, 9, 9, 19, 9, 32, 21, 20, 21, 21, 14, 17, 13, 21, 19,
    27, 19, 19, 17, 21, 11, 21, 27, 16, 21, 11, 13, 13, 27, 27, 27, 19, 18, 21, 20, 16,
];

const MARGIN: usize = 2;

/// Size of the letters in the strip, px.
const SIZE: f32 = 32.0;

/// Height of the strip, px.
const HEIGHT: usize = 38;

/// Coverage of the strip, 0 to 255, and its width.
static STRIP: LazyLock<(Vec<u8>, usize)> = LazyLock::new(|| {
    let mut reader =
        png::Decoder::new(std::io::Cursor::new(include_bytes!("font.png"))).read_info().expect("font.png is a PNG");
    let width = reader.info().width as usize;
    let mut bytes = vec![0; width * HEIGHT];
    reader.next_frame(&mut bytes).expect("font.png is greyscale, 38 px high");
    (bytes, width)
});

/// Position and width of a glyph in the strip; unknown characters show as `?`.
fn glyph(letter: char) -> (usize, usize) {
    let index = GLYPHS.chars().position(|g| g == letter).unwrap_or(31);
    let left = WIDTHS[..index].iter().map(|&w| usize::from(w) + 2 * MARGIN).sum::<usize>();
    (left, usize::from(WIDTHS[index]))
}

/// Width of a line of text, px.
pub fn width(text: &str, size: f32) -> f32 {
    text.chars().map(|c| glyph(c).1 as f32).sum::<f32>() * size / SIZE
}

/// Draws a line of text whose box has this left end and top, px.
pub fn draw(image: &mut Image, left: f32, top: f32, size: f32, text: &str, colour: Rgb) {
    let scale = SIZE / size;
    let mut pen = left;
    for letter in text.chars() {
        let (start, wide) = glyph(letter);
        let cells = [start, wide + 2 * MARGIN];
        let x0 = pen - MARGIN as f32 / scale;
        for y in top.floor() as i64..=(top + HEIGHT as f32 / scale).ceil() as i64 {
            for x in x0.floor() as i64..=(x0 + cells[1] as f32 / scale).ceil() as i64 {
                let share = coverage(cells, (x as f32 - x0) * scale, (y as f32 - top) * scale, scale);
                if share > 0.0 {
                    image.cover(x, y, colour, share);
                }
            }
        }
        pen += wide as f32 / scale;
    }
}

/// Mean coverage of a square of the strip with this corner and side, within the cells of one glyph.
fn coverage([start, cells]: [usize; 2], x: f32, y: f32, side: f32) -> f32 {
    const TAPS: usize = 4;
    let (strip, width) = &*STRIP;
    let tap = |i: usize| (i as f32 + 0.5) / TAPS as f32 * side;
    let mut sum = 0.0;
    for i in 0..TAPS {
        for j in 0..TAPS {
            let (u, v) = (x + tap(i), y + tap(j));
            if u >= 0.0 && v >= 0.0 && u < cells as f32 && v < HEIGHT as f32 {
                sum += f32::from(strip[v as usize * width + start + u as usize]);
            }
        }
    }
    sum / (255 * TAPS * TAPS) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strip_holds_every_glyph() {
        assert_eq!(GLYPHS.chars().count(), WIDTHS.len());
        let (left, wide) = glyph('–');
        assert_eq!(left + wide + 2 * MARGIN, STRIP.1);
        assert_eq!(glyph('漢'), glyph('?'));
    }

    #[test]
    fn letters_put_ink_where_they_stand() {
        let mut image = Image::new(60, 30, Rgb::ONE);
        draw(&mut image, 10.0, 2.0, 20.0, "I", Rgb::ZERO);
        let ink: f32 =
            (0..60).flat_map(|x| (0..30).map(move |y| (x, y))).map(|(x, y)| 1.0 - image.pixel(x, y)[0]).sum();
        assert!(ink > 20.0 && ink < 60.0, "{ink}");
        assert!((0..9).all(|x| (0..30).all(|y| image.pixel(x, y)[0] == 1.0)));
        assert!(width("mm", 20.0) > 3.0 * width("i", 20.0));
    }
}
