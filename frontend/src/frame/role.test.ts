import { describe, expect, it } from "vitest";
import { translator } from "../texts/texts";
import { covers, roleReason } from "./role";

const t = translator(
  { "page.role.needs": "{needed} only ({role})", "page.role.expert": "expert", "page.role.viewer": "viewer" },
  "en",
);

describe("roles", () => {
  it("cover those below them", () => {
    expect(covers("expert", "viewer")).toBe(true);
    expect(covers("technician", "technician")).toBe(true);
    expect(covers("viewer", "technician")).toBe(false);
  });

  it("name what is missing, and nothing where all is well", () => {
    expect(roleReason("viewer", "expert", t)).toBe("expert only (viewer)");
    expect(roleReason("expert", "expert", t)).toBeNull();
  });
});
