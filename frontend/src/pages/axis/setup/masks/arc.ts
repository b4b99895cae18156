/** A half circle from -180° on the left over 0° at the top to 180° on the right. */

export interface Point {
  x: number;
  y: number;
}

const FULL_DEG = 180;
const RAD = Math.PI / 180;

/** Half of the angle is drawn, so that a whole turn fits. */
const drawn = (angleDeg: number): number =>
  (90 - Math.min(FULL_DEG, Math.max(-FULL_DEG, angleDeg)) / 2) * RAD;

export function pointAt(angleDeg: number, radius: number): Point {
  return { x: radius * Math.cos(drawn(angleDeg)), y: -radius * Math.sin(drawn(angleDeg)) };
}

/** The angle at a place; below the base line that of the nearer end. */
export function angleAt({ x, y }: Point): number {
  if (y > 0) return x < 0 ? -FULL_DEG : FULL_DEG;
  return (90 - Math.atan2(-y, x) / RAD) * 2;
}

/** Path of an arc between two angles. */
export function arcPath(fromDeg: number, toDeg: number, radius: number): string {
  const [from, to] = [pointAt(fromDeg, radius), pointAt(toDeg, radius)];
  return `M ${from.x} ${from.y} A ${radius} ${radius} 0 0 1 ${to.x} ${to.y}`;
}
