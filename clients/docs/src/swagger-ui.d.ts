declare module "swagger-ui-dist/swagger-ui-es-bundle.js" {
  /** https://swagger.io/docs/open-source-tools/swagger-ui/usage/configuration/ */
  const SwaggerUI: (configuration: Readonly<Record<string, unknown>>) => unknown;
  export default SwaggerUI;
}
