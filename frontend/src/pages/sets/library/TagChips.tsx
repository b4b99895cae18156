import { IconFlag, IconPackage, IconStar } from "@tabler/icons-react";
import type { SetTag } from "../../../api/types";
import { useTexts } from "../../../texts/texts";
import { dayAndTime } from "../../../ui/format";
import classes from "./Library.module.css";

const ICONS = {
  "as-delivered": IconPackage,
  golden: IconStar,
  "as-found": IconFlag,
  "as-left": IconFlag,
};

export const tagKey = (tag: SetTag["tag"]) => `set.tag.${tag.replaceAll("-", "_")}`;

/** The tags that a set bears, each with who gave it and when. */
export function TagChips({ tags }: { tags: readonly SetTag[] }) {
  const t = useTexts();
  return tags.map((one) => {
    const Icon = ICONS[one.tag];
    return (
      <span
        key={`${one.tag} ${one.visit_id ?? ""}`}
        className={classes.chip}
        data-tag={one.tag}
        title={`${one.person}, ${dayAndTime(one.t_ns / 1e6)}`}
        data-testid={`tag-${one.tag}`}
      >
        <Icon size={13} aria-hidden /> {t(tagKey(one.tag))}
      </span>
    );
  });
}
