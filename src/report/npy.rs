//! NPY 1.0: arrays of doubles that NumPy, Julia and MATLAB readers open directly.
//!
//! Reference: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".

use super::ReportError;

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// The bytes of an NPY 1.0 file: little-endian doubles, C order (last index fastest).
///
/// `shape` may have any number of axes; none is a single number. Non-finite values are kept.
///
/// ```
/// let bytes = grazemap::report::npy_bytes(&[2, 3], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])?;
/// assert_eq!(bytes.len(), 128 + 6 * 8);
/// # Ok::<(), grazemap::report::ReportError>(())
/// ```
///
/// # Errors
///
/// [`ReportError::ArrayShape`] if the number of values is not the product of `shape`, or if the
/// shape has so many axes that the header would not fit the 65 535 bytes of version 1.0.
pub fn npy_bytes(shape: &[usize], values: &[f64]) -> Result<Vec<u8>, ReportError> {
    let expected = shape.iter().try_fold(1_usize, |size, &axis| size.checked_mul(axis));
    let refuse = || ReportError::ArrayShape {
        shape: shape.to_vec(),
        expected: expected.unwrap_or(usize::MAX),
        found: values.len(),
    };
    if expected != Some(values.len()) {
        return Err(refuse());
    }
    let header = header(shape);
    let length = u16::try_from(header.len()).map_err(|_| refuse())?;
    let mut bytes = Vec::with_capacity(MAGIC.len() + 2 + header.len() + 8 * values.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    for value in values {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    Ok(bytes)
}

/// The Python dictionary, padded so that the data begin at a multiple of 64 bytes.
fn header(shape: &[usize]) -> String {
    let axes: Vec<String> = shape.iter().map(ToString::to_string).collect();
    let comma = if shape.len() == 1 { "," } else { "" };
    let mut text = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}{comma}), }}",
        axes.join(", ")
    );
    let preamble = MAGIC.len() + 2;
    let total = (preamble + text.len() + 1).next_multiple_of(64);
    text.push_str(&" ".repeat(total - preamble - text.len() - 1));
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header_of(bytes: &[u8]) -> (String, usize) {
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = String::from_utf8(bytes[10..10 + length].to_vec()).expect("the header is ASCII");
        (text, 10 + length)
    }

    #[test]
    fn header_states_type_order_and_shape_and_data_begin_aligned() {
        for (shape, written) in [
            (vec![], "()"),
            (vec![6], "(6,)"),
            (vec![2, 3], "(2, 3)"),
            (vec![1, 2, 3], "(1, 2, 3)"),
        ] {
            let size = shape.iter().product();
            let bytes = npy_bytes(&shape, &vec![1.5; size]).expect("the shape fits");
            let (header, start) = header_of(&bytes);
            assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
            assert_eq!(start % 64, 0);
            assert!(header.ends_with('\n'));
            assert_eq!(
                header.trim_end(),
                format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {written}, }}")
            );
            assert_eq!(bytes.len(), start + 8 * size);
        }
    }

    #[test]
    fn values_are_little_endian_doubles_in_the_order_given() {
        let values = [0.1, -0.0, f64::INFINITY, 1e-300];
        let bytes = npy_bytes(&[2, 2], &values).expect("the shape fits");
        let (_, start) = header_of(&bytes);
        for (chunk, value) in bytes[start..].chunks_exact(8).zip(values) {
            let read = f64::from_le_bytes(chunk.try_into().expect("eight bytes"));
            assert_eq!(read.to_bits(), value.to_bits());
        }
    }

    #[test]
    fn shapes_that_do_not_fit_are_refused() {
        assert!(npy_bytes(&[2, 2], &[0.0; 3]).is_err());
        assert!(npy_bytes(&[usize::MAX, 2], &[]).is_err());
        assert!(npy_bytes(&[1; 40_000], &[0.0]).is_err());
        assert!(npy_bytes(&[0, 4], &[]).is_ok());
    }
}
