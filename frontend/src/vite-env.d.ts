/// <reference types="vite/client" />

declare module "virtual:boot-texts" {
  const texts: Record<string, Record<string, string>>;
  export default texts;
}
