model Bioreactor "a continuous fermenter: Monod growth on one substrate"
  parameter Real mu_max(unit="1/h", min=0) = 0.4 "largest growth rate";
  parameter Real Ks(unit="g/l", min=0) = 0.5 "substrate at half of it";
  parameter Real Y(min=0, max=1) = 0.4 "biomass from a gram of substrate";
  parameter Real kd(unit="1/h", min=0) = 0.01 "decay";
  input Real D(unit="1/h") "flow of the feed, by the volume";
  input Real Sf(unit="g/l") "substrate in the feed";
  output Real X(unit="g/l", min=0, start=2) "biomass";
  output Real S(unit="g/l", min=0, start=1) "substrate";
  Real growth(unit="g/(l.h)") = mu_max*S/(Ks + S)*X;
equation
  der(X) = growth - (D + kd)*X;
  der(S) = D*(Sf - S) - growth/Y;
end Bioreactor;
