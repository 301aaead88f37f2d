model QuadrupleTank "two pumps, each into a lower tank and the upper one across; the upper ones drain into the lower ones"
  final parameter Real A(unit="cm2") = 30 "cross-section of each";
  parameter Real k1(unit="cm3/(s.V)", min=0) = 3 "pump 1";
  parameter Real k2(unit="cm3/(s.V)", min=0) = 3 "pump 2";
  parameter Real g1(min=0, max=1) = 0.6 "share of pump 1 that goes to tank 1; the rest goes to tank 4";
  parameter Real g2(min=0, max=1) = 0.6 "share of pump 2 that goes to tank 2; the rest goes to tank 3";
  parameter Real a1(unit="cm2", min=0) = 0.1 "outlets, as Torricelli's law has them";
  parameter Real a2(unit="cm2", min=0) = 0.1;
  parameter Real a3(unit="cm2", min=0) = 0.1;
  parameter Real a4(unit="cm2", min=0) = 0.1;
  constant Real g(unit="cm/s2") = 981 "gravity";
  input Real u1(unit="V") "pump 1";
  input Real u2(unit="V") "pump 2";
  output Real h1(unit="cm", min=0, start=10) "lower left";
  output Real h2(unit="cm", min=0, start=10) "lower right";
  Real h3(unit="cm", min=0, start=4) "upper left, above tank 1";
  Real h4(unit="cm", min=0, start=4) "upper right, above tank 2";
  Real q1(unit="cm3/s") = a1*sqrt(2*g*max(h1, 0));
  Real q2(unit="cm3/s") = a2*sqrt(2*g*max(h2, 0));
  Real q3(unit="cm3/s") = a3*sqrt(2*g*max(h3, 0));
  Real q4(unit="cm3/s") = a4*sqrt(2*g*max(h4, 0));
equation
  A*der(h1) = g1*k1*u1 + q3 - q1;
  A*der(h2) = g2*k2*u2 + q4 - q2;
  A*der(h3) = (1 - g2)*k2*u2 - q3;
  A*der(h4) = (1 - g1)*k1*u1 - q4;
end QuadrupleTank;
