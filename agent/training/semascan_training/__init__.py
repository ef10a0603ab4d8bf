"""Training of Semascan's networks: from labelled views to an ONNX file with its manifest (P0, section 'Segmentation')."""
