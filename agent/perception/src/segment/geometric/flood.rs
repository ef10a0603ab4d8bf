//! 4-connected growth over a picture: the islands of the noise filter and the pieces of superpixels.

/// Grows `region` from the pixel `start` of a `width` by `height` picture, breadth first: `claim(from, to)` says whether
/// the neighbour `to` of the member `from` joins, and must say so only once for each pixel.
pub(super) fn grow(
    start: usize,
    (width, height): (usize, usize),
    region: &mut Vec<usize>,
    mut claim: impl FnMut(usize, usize) -> bool,
) {
    region.clear();
    region.push(start);
    let mut at = 0;
    while let Some(&i) = region.get(at) {
        at += 1;
        let (x, y) = (i % width, i / width);
        let neighbours = [
            (x > 0).then(|| i - 1),
            (x + 1 < width).then_some(i + 1),
            (y > 0).then(|| i - width),
            (y + 1 < height).then_some(i + width),
        ];
        for j in neighbours.into_iter().flatten() {
            if claim(i, j) {
                region.push(j);
            }
        }
    }
}
