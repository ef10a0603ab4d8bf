// An identity provider (OpenID Connect) at which everybody is logged in already: metadata, keys, a page that leads back, and a token
// endpoint that signs with RS256.

import { createHash, createSign, generateKeyPairSync, randomUUID } from 'node:crypto';
import { once } from 'node:events';
import { createServer } from 'node:http';

const base64 = (value) => Buffer.from(typeof value === 'string' ? value : JSON.stringify(value)).toString('base64url');

/** A running provider. */
export class Provider {
  #server;
  #key = generateKeyPairSync('rsa', { modulusLength: 2048 });
  #codes = new Map();
  /** Groups of whoever logs in next. */
  groups = [];
  /** Whether it takes no codes. */
  fails = false;

  /**
   * Starts one on a free port of the loopback interface.
   * @param {string} client the client that its tokens are for
   */
  static async start(client) {
    const provider = new Provider();
    provider.client = client;
    provider.#server = createServer((request, response) => provider.#answer(request, response));
    provider.#server.listen(0, '127.0.0.1');
    await once(provider.#server, 'listening');
    provider.issuer = `http://127.0.0.1:${provider.#server.address().port}`;
    return provider;
  }

  stop() {
    this.#server.closeAllConnections();
    this.#server.close();
  }

  async #answer(request, response) {
    const url = new URL(request.url, this.issuer);
    const json = (value, status = 200) => response.writeHead(status, { 'content-type': 'application/json' }).end(JSON.stringify(value));
    switch (url.pathname) {
      case '/.well-known/openid-configuration':
        return json({
          issuer: this.issuer,
          authorization_endpoint: `${this.issuer}/authorize`,
          token_endpoint: `${this.issuer}/token`,
          jwks_uri: `${this.issuer}/keys`,
          response_types_supported: ['code'],
          subject_types_supported: ['public'],
          id_token_signing_alg_values_supported: ['RS256'],
        });
      case '/keys':
        return json({ keys: [{ ...this.#key.publicKey.export({ format: 'jwk' }), kid: '1', use: 'sig', alg: 'RS256' }] });
      case '/authorize': {
        const code = randomUUID();
        this.#codes.set(code, url.searchParams);
        const back = new URL(url.searchParams.get('redirect_uri'));
        back.searchParams.set('code', code);
        back.searchParams.set('state', url.searchParams.get('state'));
        // As a person does it: by a click on a page of another site.
        const page = `<!doctype html><title>Provider</title><a id="go" href="${back.href.replaceAll('&', '&amp;')}">Go on as Anna</a>`;
        return response.writeHead(200, { 'content-type': 'text/html' }).end(page);
      }
      case '/token': {
        if (this.fails) return response.writeHead(500).end();
        let body = '';
        for await (const piece of request) body += piece;
        const form = new URLSearchParams(body);
        const asked = this.#codes.get(form.get('code'));
        this.#codes.delete(form.get('code'));
        const verifier = createHash('sha256').update(form.get('code_verifier') ?? '').digest('base64url');
        if (asked?.get('code_challenge') !== verifier) return json({ error: 'invalid_grant' }, 400);
        return json({ access_token: 'a', token_type: 'Bearer', id_token: this.#token(asked.get('nonce')) });
      }
      default:
        return response.writeHead(404).end();
    }
  }

  #token(nonce) {
    const now = Math.floor(Date.now() / 1000);
    const person = { sub: '7f', preferred_username: 'anna', groups: this.groups };
    const claims = { iss: this.issuer, aud: this.client, iat: now, exp: now + 60, nonce, ...person };
    const signed = `${base64({ alg: 'RS256', kid: '1' })}.${base64(claims)}`;
    return `${signed}.${createSign('sha256').update(signed).sign(this.#key.privateKey, 'base64url')}`;
  }
}
