import com.google.inject.Injector;
import java.io.File;
import java.util.ArrayList;
import java.util.Collection;
import java.util.Collections;
import java.util.List;
import org.eclipse.emf.common.util.URI;
import org.eclipse.emf.ecore.util.EcoreUtil;
import org.eclipse.xtext.diagnostics.Severity;
import org.eclipse.xtext.resource.XtextResource;
import org.eclipse.xtext.resource.XtextResourceSet;
import org.eclipse.xtext.util.CancelIndicator;
import org.eclipse.xtext.validation.CheckMode;
import org.eclipse.xtext.validation.Issue;
import org.franca.core.dsl.FrancaIDLStandaloneSetup;
import org.franca.core.franca.FrancaPackage;
import org.franca.deploymodel.dsl.FDeployStandaloneSetup;
import org.franca.deploymodel.extensions.AbstractFDeployExtension;
import org.franca.deploymodel.extensions.ExtensionRegistry;

/**
 * Lets Franca judge FIDL and FDEPL files: Validate SPECIFICATIONS FILE...
 *
 * SPECIFICATIONS is the folder with CommonAPI's deployment specifications, which files import by "platform:/plugin/".
 * Prints a line for each error and warning, and for each file "ok" or "failed". Exit status 1: a file failed.
 */
public final class Validate {
  /** "define … for provider as X { instance Interface { … } }", which CommonAPI adds to Franca. */
  private static final class Providers extends AbstractFDeployExtension {
    @Override
    public String getShortDescription() {
      return "providers and their instances";
    }

    @Override
    public Collection<RootDef> getRoots() {
      RootDef provider = new RootDef(this, "provider", AbstractElementDef.Nameable.MANDATORY_NAME,
          Collections.singletonList(new Host("providers")));
      provider.addChild(new ElementDef("instance", FrancaPackage.eINSTANCE.getFInterface(),
          AbstractElementDef.Nameable.OPTIONAL_NAME, Collections.singletonList(new Host("instances"))));
      return Collections.singletonList(provider);
    }
  }

  public static void main(String[] arguments) throws Exception {
    for (String plugin : List.of("org.genivi.commonapi.core", "org.genivi.commonapi.someip")) {
      org.eclipse.emf.ecore.resource.URIConverter.URI_MAP.put(URI.createURI("platform:/plugin/" + plugin + "/"),
          URI.createFileURI(new File(arguments[0], plugin).getAbsolutePath() + "/"));
    }
    ExtensionRegistry.addExtension(new Providers());
    Injector fidl = new FrancaIDLStandaloneSetup().createInjectorAndDoEMFRegistration();
    Injector fdepl = new FDeployStandaloneSetup().createInjectorAndDoEMFRegistration();
    boolean allAreFine = true;
    for (String file : List.of(arguments).subList(1, arguments.length)) {
      boolean isFine = isFine(file, file.endsWith(".fdepl") ? fdepl : fidl);
      System.out.println((isFine ? "ok " : "failed ") + file);
      allAreFine &= isFine;
    }
    System.exit(allAreFine ? 0 : 1);
  }

  private static boolean isFine(String file, Injector injector) {
    boolean isFine = true;
    try {
      XtextResource resource = (XtextResource) injector.getInstance(XtextResourceSet.class)
          .getResource(URI.createFileURI(new File(file).getAbsolutePath()), true);
      EcoreUtil.resolveAll(resource);
      List<Issue> issues = new ArrayList<>(resource.getResourceServiceProvider().getResourceValidator().validate(
          resource, CheckMode.ALL, CancelIndicator.NullImpl));
      for (Issue issue : issues) {
        boolean isError = issue.getSeverity() == Severity.ERROR;
        isFine &= !isError;
        System.out.println(file + ":" + issue.getLineNumber() + ": " + (isError ? "error: " : "warning: ") + issue.getMessage());
      }
    } catch (RuntimeException failure) {
      System.out.println(file + ": error: " + failure);
      isFine = false;
    }
    return isFine;
  }

  private Validate() {}
}
