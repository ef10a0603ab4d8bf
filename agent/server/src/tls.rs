//! TLS: the certificate that the agent shows, read from files and read again when it is told to, or a first one that it makes
//! itself.
//!
//! A certificate that the agent made is signed by nobody: browsers warn of it, and whoever connects compares its fingerprint
//! with what the agent printed. Protocol versions are TLS 1.2 and 1.3, ciphers those of rustls.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use rcgen::{CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, KeyPair, KeyUsagePurpose, SanType};
use rustls::ServerConfig;
use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use sha2::{Digest, Sha256};
use std::fs;
use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, SystemTime};
use tokio_rustls::TlsAcceptor;

/// A certificate that the agent makes is valid for so long: until somebody brings a better one.
const VALID: Duration = Duration::from_secs(10 * 365 * 24 * 3600);
/// Clocks of clients may be behind by so much.
const BEFORE: Duration = Duration::from_secs(24 * 3600);
/// Characters of a line of a PEM file (RFC 7468).
const PEM_LINE: usize = 64;
/// The files of a certificate that the agent makes.
const OWN_FILES: [&str; 2] = ["certificate.pem", "key.pem"];

/// Why there can be no TLS.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// A file cannot be read or written.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// Certificate and key do not go together, or cannot be used.
    #[error("{} with {}: {reason}", certificate.display(), key.display())]
    Pair {
        /// The file with the certificate.
        certificate: PathBuf,
        /// The file with the key.
        key: PathBuf,
        /// Why not.
        reason: String,
    },
    /// A certificate could not be made.
    #[error("no certificate could be made: {0}")]
    Made(#[from] rcgen::Error),
}

/// The files of a certificate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TlsFiles {
    /// The certificate and those that it rests on, as PEM, its own first.
    pub certificate: PathBuf,
    /// Its private key as PEM.
    pub key: PathBuf,
}

/// What the agent shows to those who connect.
#[derive(Debug)]
pub struct Tls {
    files: TlsFiles,
    current: RwLock<Current>,
}

#[derive(Clone, Debug)]
struct Current {
    config: Arc<ServerConfig>,
    fingerprint: String,
}

impl Tls {
    /// Reads the certificate in `files`.
    ///
    /// # Errors
    /// [`TlsError`] naming the file.
    pub fn open(files: TlsFiles) -> Result<Self, TlsError> {
        let current = RwLock::new(read(&files)?);
        Ok(Self { files, current })
    }

    /// Reads the certificate again, for connections that come from now on.
    ///
    /// # Errors
    /// [`TlsError`] naming the file; the certificate of before stays.
    pub fn reload(&self) -> Result<(), TlsError> {
        let read = read(&self.files)?;
        *self.current.write().unwrap_or_else(PoisonError::into_inner) = read;
        Ok(())
    }

    /// The SHA-256 fingerprint of the certificate as browsers show it.
    pub fn fingerprint(&self) -> String {
        self.current().fingerprint
    }

    /// What does the next handshake.
    pub(super) fn acceptor(&self) -> TlsAcceptor {
        self.current().config.into()
    }

    fn current(&self) -> Current {
        self.current.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The certificate in the folder `folder`, which is made where there is none: for this machine's name, loopback, `names` and
/// `addresses`. Its key can be read by its owner only.
///
/// # Errors
/// [`TlsError`] naming the file.
pub fn own_certificate(folder: &Path, names: &[String], addresses: &[IpAddr]) -> Result<TlsFiles, TlsError> {
    let [certificate, key] = OWN_FILES.map(|name| folder.join(name));
    let files = TlsFiles { certificate, key };
    if files.certificate.exists() {
        return Ok(files);
    }
    make_folder(folder).map_err(|error| file_error(folder, &error))?;
    let pair = KeyPair::generate()?;
    let made = parameters(names, addresses)?.self_signed(&pair)?;
    // The key of a certificate that did not come to be is nobody's.
    match fs::remove_file(&files.key) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(file_error(&files.key, &error)),
        _ => {}
    }
    write(&files.key, &pem("PRIVATE KEY", pair.serialized_der()))?;
    // The certificate comes last, under its name at once: where it is, both are whole.
    let unfinished = folder.join(".certificate.pem");
    let _ = fs::remove_file(&unfinished);
    write(&unfinished, &pem("CERTIFICATE", made.der()))?;
    fs::rename(&unfinished, &files.certificate).map_err(|error| file_error(&files.certificate, &error))?;
    Ok(files)
}

fn parameters(names: &[String], addresses: &[IpAddr]) -> Result<CertificateParams, TlsError> {
    let machine = machine_name();
    let mut parameters = CertificateParams::default();
    parameters.distinguished_name = DistinguishedName::new();
    parameters.distinguished_name.push(DnType::CommonName, machine.as_deref().unwrap_or("semascan"));
    parameters.distinguished_name.push(DnType::OrganizationName, "Semascan agent");
    let mut subjects = vec!["localhost".to_owned()];
    subjects.extend(machine);
    subjects.extend_from_slice(names);
    let mut hosts: Vec<IpAddr> = vec![Ipv4Addr::LOCALHOST.into(), Ipv6Addr::LOCALHOST.into()];
    hosts.extend(addresses.iter().filter(|address| !address.is_unspecified()));
    subjects.sort_unstable();
    subjects.dedup();
    hosts.sort_unstable();
    hosts.dedup();
    let named = subjects.into_iter().map(|name| Ok(SanType::DnsName(name.try_into()?)));
    let numbered = hosts.into_iter().map(|address| Ok(SanType::IpAddress(address)));
    parameters.subject_alt_names = named.chain(numbered).collect::<Result<_, rcgen::Error>>()?;
    parameters.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    parameters.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
    let now = SystemTime::now();
    parameters.not_before = (now - BEFORE).into();
    parameters.not_after = (now + VALID).into();
    Ok(parameters)
}

/// The name of this machine, where it has one that a certificate can name.
fn machine_name() -> Option<String> {
    #[cfg(unix)]
    let name = rustix::system::uname().nodename().to_str().ok()?.to_owned();
    #[cfg(not(unix))]
    let name = std::env::var("COMPUTERNAME").ok()?;
    let plain = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'.');
    plain.then_some(name)
}

fn read(files: &TlsFiles) -> Result<Current, TlsError> {
    let TlsFiles { certificate, key } = files;
    let in_file = |path: &Path| {
        let path = path.to_owned();
        move |error: rustls::pki_types::pem::Error| TlsError::File { path, reason: pem_reason(&error) }
    };
    let text = fs::read(certificate).map_err(|error| file_error(certificate, &error))?;
    let chain = CertificateDer::pem_slice_iter(&text).collect::<Result<Vec<_>, _>>().map_err(in_file(certificate))?;
    let Some(own) = chain.first() else {
        return Err(TlsError::File {
            path: certificate.clone(),
            reason: "holds no certificate (PEM is expected)".into(),
        });
    };
    let digest: [u8; 32] = Sha256::digest(own).into();
    let fingerprint = digest.map(|byte| format!("{byte:02X}")).join(":");
    let text = fs::read(key).map_err(|error| file_error(key, &error))?;
    warn_if_others_can_read(key);
    let private = PrivateKeyDer::from_pem_slice(&text).map_err(in_file(key))?;
    let pair = |error: rustls::Error| TlsError::Pair {
        certificate: certificate.clone(),
        key: key.clone(),
        reason: error.to_string(),
    };
    let mut config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(pair)?
        .with_no_client_auth()
        .with_single_cert(chain, private)
        .map_err(pair)?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Current { config: Arc::new(config), fingerprint })
}

fn pem_reason(error: &rustls::pki_types::pem::Error) -> String {
    match error {
        rustls::pki_types::pem::Error::NoItemsFound => "holds no private key (PEM is expected)".into(),
        error => error.to_string(),
    }
}

#[cfg(unix)]
fn warn_if_others_can_read(key: &Path) {
    use std::os::unix::fs::PermissionsExt;
    if fs::metadata(key).is_ok_and(|about| about.permissions().mode() & 0o077 != 0) {
        tracing::warn!("{}: others than its owner can read this private key: chmod 600 it", key.display());
    }
}

#[cfg(not(unix))]
fn warn_if_others_can_read(_key: &Path) {}

/// `der` as PEM (RFC 7468).
fn pem(label: &str, der: &[u8]) -> String {
    let text = BASE64_STANDARD.encode(der);
    let lines = text.as_bytes().chunks(PEM_LINE).map(String::from_utf8_lossy).collect::<Vec<_>>().join("\n");
    format!("-----BEGIN {label}-----\n{lines}\n-----END {label}-----\n")
}

#[cfg(unix)]
fn make_folder(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)
}

#[cfg(not(unix))]
fn make_folder(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)
}

/// Writes a new file that its owner alone can read, and brings it to the disk.
fn write(path: &Path, text: &str) -> Result<(), TlsError> {
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.mode(0o600);
    }
    let written = options.open(path).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.sync_all()
    });
    written.map_err(|error| file_error(path, &error))
}

fn file_error(path: &Path, error: &io::Error) -> TlsError {
    TlsError::File { path: path.to_owned(), reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(folder: &Path) -> TlsFiles {
        own_certificate(folder, &["cell.factory".into()], &[[10, 0, 0, 7].into(), [0, 0, 0, 0].into()]).expect("made")
    }

    #[test]
    fn a_certificate_is_made_once_and_its_key_is_private() {
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("tls");
        let first = Tls::open(made(&folder)).expect("opens");
        let again = Tls::open(own_certificate(&folder, &[], &[]).expect("there")).expect("opens");
        assert_eq!(first.fingerprint(), again.fingerprint());
        assert_eq!(first.fingerprint().len(), 95, "32 pairs of digits and 31 colons");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode() & 0o777;
            assert_eq!((mode(&folder.join("key.pem")), mode(&folder)), (0o600, 0o700));
        }
        // A key that is left without a certificate is made anew, and a name that is none is refused.
        fs::remove_file(folder.join("certificate.pem")).expect("removed");
        assert_ne!(Tls::open(made(&folder)).expect("opens").fingerprint(), first.fingerprint());
        assert!(own_certificate(&root.path().join("other"), &["bücher".into()], &[]).is_err());
    }

    #[test]
    fn what_cannot_be_used_is_named_and_the_certificate_of_before_stays() {
        let root = tempfile::tempdir().expect("a folder");
        let (one, two) = (made(&root.path().join("one")), made(&root.path().join("two")));
        let mixed = TlsFiles { key: two.key.clone(), ..one.clone() };
        let said = Tls::open(mixed).expect_err("another's key").to_string();
        assert!(said.contains("one/certificate.pem") && said.contains("two/key.pem"), "{said}");
        for (files, name) in [
            (TlsFiles { key: one.certificate.clone(), ..one.clone() }, "certificate.pem: holds no private key"),
            (TlsFiles { certificate: one.key.clone(), ..one.clone() }, "key.pem: holds no certificate"),
            (TlsFiles { key: root.path().join("none.pem"), ..one.clone() }, "none.pem"),
        ] {
            let said = Tls::open(files).expect_err(name).to_string();
            assert!(said.contains(name), "{said}");
        }
        let tls = Tls::open(one.clone()).expect("opens");
        let before = tls.fingerprint();
        fs::write(&one.certificate, "nonsense").expect("written");
        assert!(tls.reload().is_err());
        assert_eq!(tls.fingerprint(), before);
        fs::copy(&two.certificate, &one.certificate).expect("copied");
        fs::copy(&two.key, &one.key).expect("copied");
        tls.reload().expect("read again");
        assert_eq!(tls.fingerprint(), Tls::open(two).expect("opens").fingerprint());
    }
}
