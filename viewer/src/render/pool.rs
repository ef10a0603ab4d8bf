//! Which blocks of which data textures hold which chunk.
//!
//! All points live in a few textures of one size (pages), cut into blocks of 256 points. A chunk owns whole blocks, not
//! necessarily neighbours; the free slots of its blocks are marked empty and draw nothing. So a page is drawn by one call
//! over its used blocks, whatever chunks they belong to, and a replaced chunk reuses its blocks: memory follows the
//! model's size, not its history.

use std::collections::BTreeMap;

/// Points of a block.
pub const BLOCK_POINTS: usize = 256;

/// Blocks of a page: 262 144 points, 8 MB.
pub const PAGE_BLOCKS: usize = 1024;

/// Texels of a page along x (the least that WebGL2 promises) and y; a point takes two texels.
pub const PAGE_WIDTH: usize = 2048;
/// See [`PAGE_WIDTH`].
pub const PAGE_HEIGHT: usize = BLOCK_POINTS * PAGE_BLOCKS * 2 / PAGE_WIDTH;

/// One block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Block {
    /// Index of the page.
    pub page: usize,
    /// Index in the page.
    pub index: usize,
}

impl Block {
    /// First texel of the block in its page; it covers `2 * BLOCK_POINTS` texels of that row.
    pub fn texel(self) -> [u32; 2] {
        let texel = self.index * BLOCK_POINTS * 2;
        [(texel % PAGE_WIDTH) as u32, (texel / PAGE_WIDTH) as u32]
    }
}

/// The occupied blocks of one page.
#[derive(Clone, Debug)]
struct Page([u64; PAGE_BLOCKS / 64]);

impl Page {
    const EMPTY: Self = Self([0; PAGE_BLOCKS / 64]);

    fn take_lowest(&mut self) -> Option<usize> {
        let word = self.0.iter().position(|w| *w != u64::MAX)?;
        let bit = self.0[word].trailing_ones() as usize;
        self.0[word] |= 1 << bit;
        Some(word * 64 + bit)
    }

    fn free(&mut self, index: usize) {
        self.0[index / 64] &= !(1 << (index % 64));
    }

    /// One past the highest occupied block.
    fn end(&self) -> usize {
        let top = self.0.iter().rposition(|w| *w != 0);
        top.map_or(0, |word| word * 64 + 64 - self.0[word].leading_zeros() as usize)
    }
}

/// What must be written after a chunk has been placed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Placement {
    /// The chunk's blocks.
    pub blocks: Vec<Block>,
    /// Blocks that it had and needs no more: to be emptied.
    pub emptied: Vec<Block>,
}

/// The blocks of every chunk.
#[derive(Clone, Debug, Default)]
pub struct Pool {
    pages: Vec<Page>,
    chunks: BTreeMap<[i32; 3], Vec<Block>>,
}

impl Pool {
    /// Makes room for `points` points of chunk `id`, whatever it held before.
    pub fn place(&mut self, id: [i32; 3], points: usize) -> Placement {
        let needed = points.div_ceil(BLOCK_POINTS);
        let mut blocks = self.chunks.remove(&id).unwrap_or_default();
        let emptied = blocks.split_off(needed.min(blocks.len()));
        for block in &emptied {
            self.pages[block.page].free(block.index);
        }
        while blocks.len() < needed {
            blocks.push(self.take());
        }
        if !blocks.is_empty() {
            self.chunks.insert(id, blocks.clone());
        }
        Placement { blocks, emptied }
    }

    /// Lets go of chunk `id`; the blocks to be emptied.
    pub fn remove(&mut self, id: [i32; 3]) -> Vec<Block> {
        self.place(id, 0).emptied
    }

    /// Lets go of everything; what the pages hold is void.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// The chunk that owns a block, and which of its blocks it is.
    pub fn owner(&self, block: Block) -> Option<([i32; 3], usize)> {
        self.chunks.iter().find_map(|(id, blocks)| Some((*id, blocks.iter().position(|b| *b == block)?)))
    }

    /// Drops empty pages from the end; how many remain.
    pub fn trim(&mut self) -> usize {
        while self.pages.last().is_some_and(|page| page.end() == 0) {
            self.pages.pop();
        }
        self.pages.len()
    }

    /// Blocks to draw of each page, counted from its start.
    pub fn used_blocks(&self) -> impl Iterator<Item = usize> {
        self.pages.iter().map(Page::end)
    }

    fn take(&mut self) -> Block {
        for (page, blocks) in self.pages.iter_mut().enumerate() {
            if let Some(index) = blocks.take_lowest() {
                return Block { page, index };
            }
        }
        let mut blocks = Page::EMPTY;
        let index = blocks.take_lowest().unwrap_or(0);
        self.pages.push(blocks);
        Block { page: self.pages.len() - 1, index }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    #[test]
    fn replacing_a_chunk_for_ever_takes_no_more_room() {
        let mut pool = Pool::default();
        for round in 0..10_000 {
            pool.place([0, 0, 0], 300 + round % 700);
        }
        assert_eq!(pool.used_blocks().collect::<Vec<_>>(), [(300 + 9_999 % 700_usize).div_ceil(BLOCK_POINTS)]);
    }

    #[test]
    fn blocks_lie_inside_their_page_in_one_row() {
        for index in [0, 1, 3, 4, PAGE_BLOCKS - 1] {
            let [x, y] = Block { page: 0, index }.texel();
            assert!(x as usize + 2 * BLOCK_POINTS <= PAGE_WIDTH && (y as usize) < PAGE_HEIGHT);
        }
    }

    #[test]
    fn pages_come_and_go_with_the_model() {
        let mut pool = Pool::default();
        let full = BLOCK_POINTS * PAGE_BLOCKS;
        pool.place([0, 0, 0], full);
        pool.place([1, 0, 0], 1);
        assert_eq!(pool.used_blocks().collect::<Vec<_>>(), [PAGE_BLOCKS, 1]);
        assert_eq!(pool.remove([1, 0, 0]), [Block { page: 1, index: 0 }]);
        assert_eq!(pool.trim(), 1);
        assert_eq!(pool.remove([0, 0, 0]).len(), PAGE_BLOCKS);
        assert_eq!(pool.trim(), 0);
        assert!(pool.remove([5, 5, 5]).is_empty());
    }

    proptest! {
        #[test]
        fn no_block_ever_has_two_owners(steps in proptest::collection::vec((0i32..6, 0usize..3000), 1..60)) {
            let mut pool = Pool::default();
            let mut owned: BTreeMap<[i32; 3], Vec<Block>> = BTreeMap::new();
            for (chunk, points) in steps {
                let id = [chunk, 0, 0];
                let placed = pool.place(id, points);
                prop_assert_eq!(placed.blocks.len(), points.div_ceil(BLOCK_POINTS));
                for (i, block) in placed.blocks.iter().enumerate() {
                    prop_assert_eq!(pool.owner(*block), Some((id, i)));
                }
                prop_assert!(placed.emptied.iter().all(|b| pool.owner(*b).is_none()));
                owned.insert(id, placed.blocks.clone());
                let all: Vec<Block> = owned.values().flatten().copied().collect();
                let distinct: BTreeSet<Block> = all.iter().copied().collect();
                prop_assert_eq!(all.len(), distinct.len());
                prop_assert!(placed.emptied.iter().all(|b| !distinct.contains(b)));
                let used: Vec<usize> = pool.used_blocks().collect();
                prop_assert!(all.iter().all(|b| b.index < used[b.page]));
            }
        }
    }
}
