//! Blobs on the local disk, through `object_store`: `blobs/<first two digits>/<digest>`. A blob is written under a temporary
//! name, brought to the disk and renamed.

use object_store::local::LocalFileSystem;
use object_store::path::Path as ObjectPath;
use object_store::{Error as ObjectError, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use semascan_inspection::ports::{BlobDigest, Blobs, PortError};
use sha2::{Digest, Sha256};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::runtime::{Builder, Runtime};

/// The blobs of a data folder.
pub struct LocalBlobs {
    folder: PathBuf,
    store: Arc<LocalFileSystem>,
    /// `object_store` waits on a runtime; callers of this port need none. Absent while it is dropped.
    runtime: Option<Runtime>,
}

impl LocalBlobs {
    /// The blobs in `folder`, which is made if it is not there.
    ///
    /// # Errors
    /// [`PortError`] naming the folder.
    pub fn open(folder: &Path) -> Result<Self, PortError> {
        let error = |error: &(dyn Error + 'static)| PortError::of(folder.display(), error);
        fs::create_dir_all(folder).map_err(|e| error(&e))?;
        let store = LocalFileSystem::new_with_prefix(folder).map_err(|e| error(&e))?.with_fsync(true);
        let runtime = Builder::new_multi_thread().worker_threads(1).build().map_err(|e| error(&e))?;
        Ok(Self { folder: folder.to_owned(), store: Arc::new(store), runtime: Some(runtime) })
    }

    /// Runs `work` to its end, also where the caller runs on a runtime of its own.
    fn wait<T: Send + 'static>(
        &self,
        work: impl Future<Output = Result<T, ObjectError>> + Send + 'static,
    ) -> Result<T, ObjectError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        if let Some(runtime) = &self.runtime {
            runtime.spawn(async move { sender.send(work.await) });
        }
        receiver.recv().unwrap_or_else(|_| {
            Err(ObjectError::Generic { store: "local", source: "its runtime ended unexpectedly".into() })
        })
    }

    fn place(&self, digest: &BlobDigest) -> String {
        self.folder.join(path(digest).as_ref()).display().to_string()
    }
}

impl Drop for LocalBlobs {
    fn drop(&mut self) {
        // A runtime must not be waited for on a thread of another one.
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

impl Blobs for LocalBlobs {
    fn put(&self, content: &[u8]) -> Result<BlobDigest, PortError> {
        let digest = BlobDigest(Sha256::digest(content).into());
        let (store, payload) = (Arc::clone(&self.store), PutPayload::from(content.to_vec()));
        let put = self.wait(async move {
            let options = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
            store.put_opts(&path(&digest), payload, options).await
        });
        match put {
            Ok(_) | Err(ObjectError::AlreadyExists { .. }) => Ok(digest),
            Err(error) => Err(PortError::of(self.place(&digest), &error)),
        }
    }

    fn get(&self, digest: &BlobDigest) -> Result<Option<Vec<u8>>, PortError> {
        let (store, digest) = (Arc::clone(&self.store), *digest);
        let content = match self.wait(async move { store.get(&path(&digest)).await?.bytes().await }) {
            Ok(content) => content,
            Err(ObjectError::NotFound { .. }) => return Ok(None),
            Err(error) => return Err(PortError::of(self.place(&digest), &error)),
        };
        if digest.0 != <[u8; 32]>::from(Sha256::digest(&content)) {
            return Err(PortError::new(self.place(&digest), "is damaged: its content does not have its digest"));
        }
        Ok(Some(content.to_vec()))
    }

    fn list(&self) -> Result<Vec<BlobDigest>, PortError> {
        let store = Arc::clone(&self.store);
        let error = |error: &(dyn Error + 'static)| PortError::of(self.folder.display(), error);
        let groups = self.wait(async move { store.list_with_delimiter(None).await }).map_err(|e| error(&e))?;
        let mut found: Vec<BlobDigest> = Vec::new();
        for group in groups.common_prefixes {
            let store = Arc::clone(&self.store);
            let blobs =
                self.wait(async move { store.list_with_delimiter(Some(&group)).await }).map_err(|e| error(&e))?;
            // What has no digest for a name is no blob: somebody else put it there.
            found.extend(blobs.objects.iter().filter_map(|blob| blob.location.filename()?.parse::<BlobDigest>().ok()));
        }
        found.sort_unstable();
        Ok(found)
    }

    fn remove(&self, digest: &BlobDigest) -> Result<(), PortError> {
        let (store, digest) = (Arc::clone(&self.store), *digest);
        match self.wait(async move { store.delete(&path(&digest)).await }) {
            Ok(()) | Err(ObjectError::NotFound { .. }) => Ok(()),
            Err(error) => Err(PortError::of(self.place(&digest), &error)),
        }
    }
}

fn path(digest: &BlobDigest) -> ObjectPath {
    let name = digest.to_string();
    ObjectPath::from(format!("{}/{name}", &name[..2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blob_is_kept_once_comes_back_and_damage_is_named() {
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("blobs");
        let blobs = LocalBlobs::open(&folder).expect("opens");
        let digest = blobs.put(b"abc").expect("kept");
        assert_eq!(
            digest.to_string(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
            "FIPS 180-2, B.1"
        );
        assert_eq!(blobs.put(b"abc"), Ok(digest), "twice is harmless");
        let other = blobs.put(b"").expect("kept");
        let mut both = vec![digest, other];
        both.sort_unstable();
        assert_eq!(blobs.list(), Ok(both));
        assert_eq!(blobs.get(&digest), Ok(Some(b"abc".to_vec())));
        let file = folder.join("ba").join(digest.to_string());
        assert_eq!(fs::read(&file).expect("there"), b"abc");
        assert_eq!(fs::read_dir(folder.join("ba")).expect("reads").count(), 1, "no temporary file");
        fs::write(&file, "abd").expect("writes");
        let said = blobs.get(&digest).expect_err("damaged").to_string();
        assert!(said.contains(&digest.to_string()) && said.contains("damaged"), "{said}");
        blobs.remove(&digest).expect("removed");
        blobs.remove(&digest).expect("harmless");
        assert_eq!(blobs.get(&digest), Ok(None));
    }

    #[test]
    fn it_may_be_used_on_the_thread_of_another_runtime() {
        let root = tempfile::tempdir().expect("a folder");
        let runtime = Builder::new_current_thread().build().expect("a runtime");
        runtime.block_on(async {
            let blobs = LocalBlobs::open(root.path()).expect("opens");
            assert!(blobs.put(b"x").is_ok());
        });
    }
}
