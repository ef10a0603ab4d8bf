//! The GLB container (glTF 2.0, section 4.4): header, JSON chunk padded with spaces, BIN chunk padded with zeros.

use crate::export::ExportError;
use std::io::Write;

/// Writes both chunks; an empty buffer gives no BIN chunk.
pub(super) fn write(mut out: impl Write, json: &[u8], binary: &[u8]) -> Result<(), ExportError> {
    let chunks = [(b"JSON", json, b' '), (b"BIN\0", binary, 0)];
    let present = || chunks.iter().filter(|(_, bytes, _)| !bytes.is_empty());
    let total = 12 + present().map(|(_, bytes, _)| 8 + bytes.len().next_multiple_of(4)).sum::<usize>();
    let limit = u32::MAX as usize;
    let length = u32::try_from(total).map_err(|_| ExportError::TooLarge { what: "the scene", len: total, limit })?;
    out.write_all(b"glTF")?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&length.to_le_bytes())?;
    for (kind, bytes, fill) in present() {
        let padded = bytes.len().next_multiple_of(4);
        // Fits, because the total does.
        out.write_all(&(padded as u32).to_le_bytes())?;
        out.write_all(*kind)?;
        out.write_all(bytes)?;
        out.write_all(&[*fill; 3][..padded - bytes.len()])?;
    }
    Ok(out.flush()?)
}
