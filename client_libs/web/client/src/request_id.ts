/** An id that no other request has: 128 random bits in hex. */
export function newRequestId(): string {
  // Not crypto.randomUUID: browsers have that on HTTPS only.
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
}
