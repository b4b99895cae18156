/** How long a blade takes. The ramps of the drive are short beside it; they are left out. */
export function travel(distanceDeg: number, speedDps: number): number | null {
  return speedDps > 0 ? Math.abs(distanceDeg) / speedDps : null;
}
