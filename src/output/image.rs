//! A picture in memory, and its PNG output.

use super::colour::{Rgb, encode};
use super::file::replace;
use crate::error::Result;
use rayon::prelude::*;
use std::io;
use std::path::Path;

/// Rows of pixels from the top, linear RGB.
#[derive(Debug, Clone)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    pixels: Vec<Rgb>,
}

impl Image {
    /// An image of one colour.
    pub fn new(width: usize, height: usize, colour: Rgb) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// The pixel at a position inside the image.
    pub fn pixel(&self, x: usize, y: usize) -> Rgb {
        self.pixels[y * self.width + x]
    }

    /// Blends a share of a colour into a pixel; positions outside are ignored.
    pub fn cover(&mut self, x: i64, y: i64, colour: Rgb, share: f32) {
        if x < 0 || y < 0 || x >= self.width as i64 || y >= self.height as i64 {
            return;
        }
        let pixel = &mut self.pixels[y as usize * self.width + x as usize];
        *pixel += share * (colour - *pixel);
    }

    /// Fills a rectangle given by its left, top, width and height, px.
    pub fn fill(&mut self, [left, top, width, height]: [f32; 4], colour: Rgb) {
        let overlap =
            |low: f32, size: f32, at: i64| ((low + size).min(at as f32 + 1.0) - low.max(at as f32)).clamp(0.0, 1.0);
        for y in top.floor() as i64..(top + height).ceil() as i64 {
            for x in left.floor() as i64..(left + width).ceil() as i64 {
                self.cover(x, y, colour, overlap(left, width, x) * overlap(top, height, y));
            }
        }
    }

    /// Pastes an image; parts outside are clipped.
    pub fn paste(&mut self, left: usize, top: usize, other: &Image) {
        let fits = other.width.min(self.width.saturating_sub(left));
        for (y, row) in other.pixels.chunks(other.width).enumerate().take(self.height.saturating_sub(top)) {
            self.pixels[(top + y) * self.width + left..][..fits].copy_from_slice(&row[..fits]);
        }
    }

    /// Mutable rows of pixels, from the top.
    pub fn rows_mut(&mut self) -> &mut [Rgb] {
        &mut self.pixels
    }

    /// Writes the image atomically.
    pub fn write_png(&self, path: &Path) -> Result<()> {
        let mut bytes = vec![0; 3 * self.pixels.len()];
        bytes.par_chunks_mut(3).zip(&self.pixels).for_each(|(bytes, pixel)| bytes.copy_from_slice(&encode(*pixel)));
        replace(path, |w| {
            let mut encoder = png::Encoder::new(w, self.width as u32, self.height as u32);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            encoder.set_compression(png::Compression::Fast);
            let mut writer = encoder.write_header().map_err(io::Error::other)?;
            writer.write_image_data(&bytes).map_err(io::Error::other)?;
            writer.finish().map_err(io::Error::other)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_reads_back() {
        let mut image = Image::new(5, 4, Rgb::ONE);
        image.fill([1.0, 1.0, 2.0, 1.0], Rgb::ZERO);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        image.write_png(&path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; 60];
        reader.next_frame(&mut bytes).unwrap();
        assert_eq!((reader.info().width, reader.info().height), (5, 4));
        let dark: Vec<usize> = (0..20).filter(|i| bytes[3 * i] == 0).collect();
        assert_eq!(dark, [6, 7]);
    }

    #[test]
    fn what_does_not_fit_is_left_out() {
        let mut image = Image::new(3, 2, Rgb::ZERO);
        image.paste(1, 1, &Image::new(5, 2, Rgb::ONE));
        let bright = (0..6).filter(|i| image.pixel(i % 3, i / 3) == Rgb::ONE).collect::<Vec<_>>();
        assert_eq!(bright, [4, 5]);
    }
}
