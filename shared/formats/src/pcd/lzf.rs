//! LZF decompression (M. Lehmann's LibLZF), as PCD files use it.

/// Most bytes that one packed byte can stand for: three bytes encode a copy of up to 264.
const MAX_RATIO: usize = 88;

/// Unpacks `packed` into exactly `length` bytes.
///
/// # Errors
/// If the data leaves its bounds or has another length; nothing is allocated for a length that `packed` cannot hold.
pub(super) fn unpack(packed: &[u8], length: usize) -> Result<Vec<u8>, String> {
    if length / MAX_RATIO > packed.len() {
        return Err(format!("{} packed bytes cannot hold {length}", packed.len()));
    }
    let mut out: Vec<u8> = Vec::with_capacity(length);
    let mut rest = packed;
    while let Some((&control, after)) = rest.split_first() {
        let control = usize::from(control);
        rest = after;
        if control < 32 {
            let (literal, after) = rest.split_at_checked(control + 1).ok_or("packed data is cut short")?;
            if literal.len() > length - out.len() {
                return Err(format!("packed data holds more than {length} bytes"));
            }
            out.extend_from_slice(literal);
            rest = after;
            continue;
        }
        let mut next = || {
            let (&byte, after) = rest.split_first().ok_or("packed data is cut short")?;
            rest = after;
            Ok::<_, &str>(usize::from(byte))
        };
        let mut count = control >> 5;
        if count == 7 {
            count += next()?;
        }
        count += 2;
        let offset = ((control & 0x1f) << 8) + next()? + 1;
        let start = out.len().checked_sub(offset).ok_or("packed data refers to before its beginning")?;
        if count > length - out.len() {
            return Err(format!("packed data holds more than {length} bytes"));
        }
        if offset >= count {
            out.extend_from_within(start..start + count);
        } else {
            // The copy runs into what it writes itself.
            for i in start..start + count {
                out.push(out[i]);
            }
        }
    }
    if out.len() != length {
        return Err(format!("packed data holds {} bytes of {length}", out.len()));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::unpack;

    #[test]
    fn literals_and_overlapping_copies() {
        // "ab", then 5 bytes from 2 back.
        assert_eq!(unpack(&[1, b'a', b'b', 3 << 5, 1], 7), Ok(b"abababa".to_vec()));
        // A long copy: 7 + 4 + 2 bytes from 1 back.
        assert_eq!(unpack(&[0, b'x', 7 << 5, 4, 0], 14), Ok(vec![b'x'; 14]));
    }

    #[test]
    fn broken_data_is_refused() {
        for (packed, length) in
            [(&[5, 1, 2][..], 6), (&[1 << 5, 9], 3), (&[7 << 5], 9), (&[0, 1], 2), (&[1, 1, 1], 1), (&[0, 1], 1 << 40)]
        {
            assert!(unpack(packed, length).is_err(), "{packed:?}");
        }
    }
}
