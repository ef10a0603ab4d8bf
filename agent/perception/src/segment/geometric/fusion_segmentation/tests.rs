//! The 50 % rule on segments and masks made by hand.

use super::*;
use proptest::prelude::*;

fn hard(labels: &[u16]) -> Segmentation {
    Segmentation {
        components: ClassField::Hard(labels.to_vec()),
        defects: ClassField::Hard(vec![0; labels.len()]),
        instances: labels.to_vec(),
        network: None,
    }
}

fn labels(s: &Segmentation) -> Vec<u16> {
    (0..s.instances.len()).map(|i| s.components.best(i)).collect()
}

#[test]
fn more_than_half_of_a_patch_decides() {
    // Patches of four: three votes fill the hole, two do not suffice, one is cleaned away; no patch, no change.
    let patches = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, NONE, NONE];
    let given = hard(&[5, 5, 0, 5, 5, 5, 0, 0, 0, 7, 0, 0, 7, 0]);
    let fused = fuse(&given, &PatchImage { patches: &patches, fine: None }, &FusionConfig::PAPER);
    assert_eq!(labels(&fused), [5, 5, 5, 5, 0, 0, 0, 0, 0, 0, 0, 0, 7, 0]);
    assert_eq!(fused.instances, labels(&fused));
}

#[test]
fn an_object_swallowed_by_a_large_patch_is_rescued() {
    // Ten pixels of table, and an object of six that convexity joined with it; a flip of one pixel to class 4.
    let patches = [0; 16];
    let fine = [0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 3, 3, 4, 4];
    let given = hard(&[0, 0, 4, 0, 0, 0, 0, 0, 0, 3, 3, 3, 3, 3, 3, 3]);
    let image = PatchImage { patches: &patches, fine: Some(&fine) };
    assert_eq!(labels(&fuse(&given, &image, &FusionConfig::PAPER)), [0; 16]);
    let kept = fuse(&given, &image, &FusionConfig::default());
    assert_eq!(labels(&kept), [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 3, 3, 3, 3, 3]);
    let strict = FusionConfig { rescued_pieces: 4, ..FusionConfig::default() };
    assert_eq!(labels(&fuse(&given, &image, &strict)), [0; 16]);
}

#[test]
fn two_instances_of_a_class_stay_apart() {
    let mut given = hard(&[2, 2, 2, 2, 2, 2]);
    given.instances = vec![1, 1, 9, 9, 9, 1];
    let fused = fuse(&given, &PatchImage { patches: &[0, 0, 0, 1, 1, 1], fine: None }, &FusionConfig::PAPER);
    assert_eq!(fused.instances, [1, 1, 1, 9, 9, 9]);
}

#[test]
fn soft_pixels_take_the_mean_of_those_that_agree() {
    let given = Segmentation {
        components: ClassField::Soft {
            classes: 2,
            probabilities: vec![55, 200, 15, 240, 255, 0, 250, 5],
            sigma: vec![10, 20, 90, 30],
            model_sigma: vec![5, 6, 7, 8],
        },
        defects: ClassField::Hard(vec![0; 4]),
        instances: vec![1, 1, 0, 0],
        network: None,
    };
    let fused = fuse(&given, &PatchImage { patches: &[0, 0, 0, 1], fine: None }, &FusionConfig::PAPER);
    let ClassField::Soft { probabilities, sigma, .. } = &fused.components else { panic!("stays soft") };
    let parts: Vec<Option<f32>> = (0..4).map(|i| fused.components.model_sigma(i).map(|part| 255.0 * part)).collect();
    assert_eq!(parts, [Some(5.0), Some(6.0), None, Some(8.0)]);
    assert_eq!(probabilities, &[55, 200, 15, 240, 35, 220, 250, 5]);
    assert_eq!(sigma, &[10, 20, 15, 30]);
    assert_eq!(fused.instances, [1, 1, 1, 0]);
}

proptest! {
    #[test]
    fn every_patch_ends_with_one_label(
        pixels in prop::collection::vec((0_u32..6, 0_u16..4), 1..80),
        share in (0..1_000_000_i32).prop_map(|k| k as f32 / 1e6),
    ) {
        let patches: Vec<u32> = pixels.iter().map(|p| if p.0 == 5 { NONE } else { p.0 }).collect();
        let given = hard(&pixels.iter().map(|p| p.1).collect::<Vec<_>>());
        let config = FusionConfig { share, ..FusionConfig::PAPER };
        let fused = labels(&fuse(&given, &PatchImage { patches: &patches, fine: None }, &config));
        for patch in 0..5 {
            let members: Vec<usize> = (0..pixels.len()).filter(|&i| patches[i] == patch).collect();
            let Some(&first) = members.first() else { continue };
            prop_assert!(members.iter().all(|&i| fused[i] == fused[first]));
            let votes = members.iter().filter(|&&i| pixels[i].1 == fused[first]).count();
            prop_assert!(fused[first] == 0 || votes as f32 > share * members.len() as f32);
        }
        for i in (0..pixels.len()).filter(|&i| patches[i] == NONE) {
            prop_assert_eq!(fused[i], pixels[i].1);
        }
    }
}
