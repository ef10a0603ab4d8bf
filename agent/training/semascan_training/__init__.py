"""Training of Semascan's networks: from labelled views to ONNX files with their manifest."""
