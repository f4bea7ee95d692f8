/** Returns a unique request id: 128 random bits in hex. */
export function newRequestId(): string {
  // Browsers offer crypto.randomUUID only on HTTPS pages.
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
}
