import classes from "./Bus.module.css";

/** A share as a bar with its figure; the longest bar is that of the largest share. */
export function Share({ share, most, text }: { share: number; most: number; text: string }) {
  return (
    <span className={classes.bar}>
      <span style={{ width: `${String(Math.min(100, (share / most) * 100))}%` }} aria-hidden />
      <em>{text}</em>
    </span>
  );
}
