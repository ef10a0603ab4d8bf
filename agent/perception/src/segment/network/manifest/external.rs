//! Which files an ONNX file keeps weights in (onnx.proto, `TensorProto.external_data`; "ONNX External Data" of its
//! documentation).
//!
//! Only the few messages on the way to a tensor are walked, in the wire format of Protocol Buffers. That is enough to hold
//! these files to their checksums, and needs no model of the whole format.

use std::collections::BTreeSet;

/// Deepest nesting of graphs in graphs.
const MAX_DEPTH: usize = 32;

/// The operator whose attribute names a compiled engine in another file ("EP Context Design" of ONNX Runtime's documentation).
const COMPILED: &[u8] = b"EPContext";

/// What is wrong with a file that is no ONNX.
const CUT: &str = "is no ONNX file, or is cut short";

/// What a message is, and which of its fields lead to tensors.
#[derive(Clone, Copy)]
enum Message {
    Model,
    Graph,
    Node,
    Attribute,
    Function,
    SparseTensor,
    Training,
    Tensor,
}

impl Message {
    /// The message in field `number`, if it leads on.
    fn field(self, number: u64) -> Option<Self> {
        Some(match (self, number) {
            (Self::Model, 7) => Self::Graph,
            (Self::Model, 20) => Self::Training,
            (Self::Model, 25) => Self::Function,
            (Self::Training, 1 | 2) => Self::Graph,
            (Self::Graph, 1) | (Self::Function, 7) => Self::Node,
            (Self::Graph, 5) | (Self::Attribute, 5 | 10) | (Self::SparseTensor, 1 | 2) => Self::Tensor,
            (Self::Graph, 15) | (Self::Attribute, 22 | 23) => Self::SparseTensor,
            (Self::Node, 5) | (Self::Function, 11) => Self::Attribute,
            (Self::Attribute, 6 | 11) => Self::Graph,
            _ => return None,
        })
    }
}

/// The names of the files that a network keeps weights in, relative to its own folder.
///
/// # Errors
/// What is wrong with the file: no ONNX, or a network that would load a compiled engine from elsewhere.
pub(super) fn weight_files(network: &[u8]) -> Result<BTreeSet<String>, String> {
    let mut files = BTreeSet::new();
    walk(network, Message::Model, 0, &mut files)?;
    Ok(files)
}

fn walk(message: &[u8], kind: Message, depth: usize, files: &mut BTreeSet<String>) -> Result<(), String> {
    if depth > 4 * MAX_DEPTH {
        return Err(format!("nests graphs deeper than {MAX_DEPTH}"));
    }
    let mut rest = message;
    while !rest.is_empty() {
        let (number, content, after) = field(rest).ok_or(CUT)?;
        rest = after;
        let Some(content) = content else { continue };
        if matches!((kind, number), (Message::Tensor, 13)) {
            files.extend(location(content).ok_or(CUT)?);
        } else if matches!((kind, number), (Message::Node, 4)) && content == COMPILED {
            return Err("holds an operator EPContext, which loads a compiled engine: export the network itself".into());
        } else if let Some(inner) = kind.field(number) {
            walk(content, inner, depth + 1, files)?;
        }
    }
    Ok(())
}

/// The value of an entry whose key is `location`.
fn location(entry: &[u8]) -> Option<Option<String>> {
    let (mut key, mut value, mut rest) = (&[][..], &[][..], entry);
    while !rest.is_empty() {
        let (number, content, after) = field(rest)?;
        rest = after;
        match (number, content) {
            (1, Some(content)) => key = content,
            (2, Some(content)) => value = content,
            _ => {}
        }
    }
    Some((key == b"location").then(|| String::from_utf8_lossy(value).into_owned()))
}

/// The number of a field, its content if that has a length, and what follows it.
type Field<'a> = (u64, Option<&'a [u8]>, &'a [u8]);

/// The next field.
fn field(bytes: &[u8]) -> Option<Field<'_>> {
    let (tag, rest) = varint(bytes)?;
    let number = tag >> 3;
    match tag & 7 {
        0 => Some((number, None, varint(rest)?.1)),
        1 => Some((number, None, rest.get(8..)?)),
        2 => {
            let (length, rest) = varint(rest)?;
            let (content, rest) = rest.split_at_checked(usize::try_from(length).ok()?)?;
            Some((number, Some(content), rest))
        }
        5 => Some((number, None, rest.get(4..)?)),
        _ => None,
    }
}

fn varint(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let mut value = 0_u64;
    for (k, byte) in bytes.iter().enumerate().take(10) {
        value |= u64::from(byte & 0x7f) << (7 * k);
        if byte & 0x80 == 0 {
            return Some((value, &bytes[k + 1..]));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A field with a length.
    fn with(number: u8, content: &[u8]) -> Vec<u8> {
        let length = content.len();
        [&[(number << 3) | 2, (length & 0x7f | 0x80) as u8, (length >> 7) as u8][..], content].concat()
    }

    #[test]
    fn weights_are_found_wherever_tensors_are() {
        let entry = |key: &str, value: &str| with(13, &[with(1, key.as_bytes()), with(2, value.as_bytes())].concat());
        let tensor = |file: &str| [entry("location", file), entry("offset", "0"), vec![0x70, 1]].concat();
        let constant = with(1, &with(5, &with(5, &tensor("constant.bin"))));
        let within = with(1, &with(5, &with(6, &with(5, &tensor("branch.bin")))));
        let graph = [with(5, &tensor("a.data")), with(5, &tensor("a.data")), constant, within].concat();
        let model = [vec![8, 8], with(7, &graph)].concat();
        let files = weight_files(&model).expect("a model");
        assert_eq!(files.iter().map(String::as_str).collect::<Vec<_>>(), ["a.data", "branch.bin", "constant.bin"]);
        assert!(weight_files(&model[..model.len() - 1]).is_err());
        assert!(weight_files(b"").expect("nothing").is_empty());
        let compiled = with(7, &with(1, &with(4, COMPILED)));
        assert!(weight_files(&compiled).expect_err("a compiled engine").contains("EPContext"));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = weight_files(&bytes);
        }
    }
}
