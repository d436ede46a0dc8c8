//! Host state as bytes: one function names every field and serves for both writing and exact restoring.

/// Bytes being written or read back.
#[derive(Debug, Clone, Default)]
pub struct Record {
    bytes: Vec<u8>,
    /// Read position; `None` while writing.
    at: Option<usize>,
    short: bool,
}

impl Record {
    /// An empty record for writing.
    pub fn new() -> Self {
        Self::default()
    }

    /// A record for reading from its start.
    pub fn read(bytes: Vec<u8>) -> Self {
        Self { bytes, at: Some(0), short: false }
    }

    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Whether every read succeeded and no bytes are left.
    pub fn complete(&self) -> bool {
        !self.short && self.at == Some(self.bytes.len())
    }

    /// A byte string of any length; shortened if the record ends early.
    pub fn bytes(&mut self, value: &mut Vec<u8>) {
        let mut count = value.len();
        count.record(self);
        match &mut self.at {
            None => self.bytes.extend(value.iter()),
            Some(at) => {
                let end = at.saturating_add(count);
                self.short |= end > self.bytes.len();
                *value = self.bytes.get(*at..end.min(self.bytes.len())).unwrap_or_default().to_vec();
                *at = end;
            }
        }
    }

    /// Writes or reads eight bytes; reads zero past the end.
    fn word(&mut self, value: &mut u64) {
        match &mut self.at {
            None => self.bytes.extend(value.to_le_bytes()),
            Some(at) => {
                let end = at.saturating_add(8);
                let bytes = self.bytes.get(*at..end).and_then(|b| b.try_into().ok());
                self.short |= bytes.is_none();
                *value = bytes.map_or(0, u64::from_le_bytes);
                *at = end;
            }
        }
    }
}

/// A value that a record can hold: `record` writes it, or replaces it by the recorded value.
pub trait Recorded {
    fn record(&mut self, record: &mut Record);
}

impl Recorded for u64 {
    fn record(&mut self, record: &mut Record) {
        record.word(self);
    }
}

impl Recorded for f64 {
    fn record(&mut self, record: &mut Record) {
        let mut bits = self.to_bits();
        bits.record(record);
        *self = f64::from_bits(bits);
    }
}

impl Recorded for bool {
    fn record(&mut self, record: &mut Record) {
        let mut word = u64::from(*self);
        word.record(record);
        *self = word != 0;
    }
}

impl Recorded for usize {
    fn record(&mut self, record: &mut Record) {
        let mut word = *self as u64;
        word.record(record);
        *self = word as usize;
    }
}

impl Recorded for u32 {
    fn record(&mut self, record: &mut Record) {
        let mut word = u64::from(*self);
        word.record(record);
        *self = word as u32;
    }
}

impl<T: Recorded, const N: usize> Recorded for [T; N] {
    fn record(&mut self, record: &mut Record) {
        self.iter_mut().for_each(|item| item.record(record));
    }
}

impl<A: Recorded, B: Recorded> Recorded for (A, B) {
    fn record(&mut self, record: &mut Record) {
        self.0.record(record);
        self.1.record(record);
    }
}

impl<T: Recorded + Default> Recorded for Vec<T> {
    fn record(&mut self, record: &mut Record) {
        let mut count = self.len();
        count.record(record);
        if let Some(at) = record.at {
            // an item takes at least one byte, so a damaged count cannot request more items than there are bytes
            self.clear();
            self.resize_with(count.min(record.bytes.len().saturating_sub(at)), T::default);
        }
        self.iter_mut().for_each(|item| item.record(record));
    }
}

impl Recorded for String {
    fn record(&mut self, record: &mut Record) {
        let mut letters: Vec<u32> = self.chars().map(u32::from).collect();
        letters.record(record);
        *self = letters.into_iter().filter_map(char::from_u32).collect();
    }
}

impl<T: Recorded + Default> Recorded for Option<T> {
    fn record(&mut self, record: &mut Record) {
        let mut list: Vec<T> = self.take().into_iter().collect();
        list.record(record);
        *self = list.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Fields = (f64, (Vec<[f64; 2]>, (String, Option<usize>)));

    #[test]
    fn what_is_written_reads_back_to_the_bit() {
        let values: Fields = (f64::NAN, (vec![[-0.0, 1.0 / 3.0], [f64::INFINITY, 5e-324]], ("γ.csv".into(), Some(7))));
        let mut record = Record::new();
        values.clone().record(&mut record);
        let bytes = record.into_bytes();
        let mut read = Fields::default();
        let mut record = Record::read(bytes.clone());
        read.record(&mut record);
        assert!(record.complete());
        let mut again = Record::new();
        read.record(&mut again);
        assert_eq!(again.into_bytes(), bytes);
        assert_eq!(read.1.1, values.1.1);
    }

    #[test]
    fn bytes_read_back_and_a_count_that_is_too_large_is_noticed() {
        let mut record = Record::new();
        record.bytes(&mut vec![1, 2, 3]);
        true.record(&mut record);
        let written = record.into_bytes();
        let (mut bytes, mut flag) = (Vec::new(), false);
        let mut record = Record::read(written.clone());
        record.bytes(&mut bytes);
        flag.record(&mut record);
        assert!(record.complete() && flag && bytes == [1, 2, 3]);
        let mut record = Record::read([&u64::MAX.to_le_bytes(), &written[8..]].concat());
        record.bytes(&mut bytes);
        flag.record(&mut record);
        assert!(!record.complete());
    }

    #[test]
    fn what_is_cut_off_is_noticed() {
        let mut record = Record::new();
        vec![1.0, 2.0].record(&mut record);
        let mut bytes = record.into_bytes();
        bytes.pop();
        let mut record = Record::read(bytes);
        Vec::<f64>::new().record(&mut record);
        assert!(!record.complete());
    }
}
